//! A service and further workers, each as on a machine of its own, on one PostgreSQL and one bucket. These run
//! by `make scale-test`, which starts the servers.

mod machines;
mod stall;
mod watched;
