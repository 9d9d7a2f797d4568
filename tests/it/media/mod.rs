//! The gate of RELIABILITY.md from outside: real footage whole, bad files with their codes.

mod real;
