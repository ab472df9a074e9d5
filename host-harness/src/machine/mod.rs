//! One cycle model per hardware unit.
