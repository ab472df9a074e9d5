//! What the papers print. These numbers stand beside ours and enter no computation of ours.

pub mod p1;
pub mod p2;
pub mod p3;
