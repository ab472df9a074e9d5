//! Placeholder-free crate root; see the crate description.
#![no_std]
