//! Simulated memory behind the core's `Bus`.
