//! A service and further workers, each as on its own machine, that share one PostgreSQL and one bucket.
//! `make scale-test` starts the servers and runs these tests.

mod machines;
mod space;
mod stall;
mod uploads;
mod watched;
