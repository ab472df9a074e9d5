//! The soft core: instruction simulator, memory map and log.
