//! Accuracy of the analysis against known truth, on generated films and on labeled recordings
//! (docs/explanation/algorithms.md, "Quality measures").

mod accuracy;
mod cases;
mod centimetres;
mod hints;
mod labels;
mod masks;
mod one;
mod rates;
mod reproduce;
mod sample;
mod staged;
