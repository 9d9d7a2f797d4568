//! File formats: conversion of values to bytes and back (docs/reference/formats.md). Only `library_dir`
//! accesses the file system.

pub mod atlas;
pub mod csv;
pub mod distance_map;
pub mod evidence;
pub mod fish_json;
pub mod flock_json;
pub mod flock_overlay;
pub mod flock_plan;
pub mod glb;
pub mod ground_truth;
pub mod library_dir;
pub mod library_json;
pub mod npy;
pub mod overlay;
pub mod params;
pub mod picture;
pub mod picture_archive;
pub mod poses_json;
pub mod svg;
