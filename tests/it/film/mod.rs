//! Accuracy against known truth, on generated films (ALGORITHMS.md 9).

mod accuracy;
mod cases;
mod hints;
mod labels;
mod masks;
mod one;
mod rates;
mod reproduce;
mod sample;
mod staged;
