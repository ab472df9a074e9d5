//! What the generated map is made of: typed registers, where they are, what may be done to them.

use core::{fmt, marker::PhantomData};

/// A 32-bit register's contents, with an accessor for each field.
///
/// `with_…` setters take the value's low bits: what does not fit the field is dropped.
pub trait Register: Copy {
    /// Contents after power-up; fields that hardware drives are 0 here.
    const RESET: Self;

    /// [`RESET`](Self::RESET) as a bus word.
    const RESET_BITS: u32;

    /// Fields by ascending bit.
    const FIELDS: &'static [FieldInfo];

    /// The contents that the bus word `bits` holds.
    fn from_bits(bits: u32) -> Self;

    /// The bus word that holds these contents.
    fn bits(self) -> u32;
}

/// A register that software can read.
pub trait Readable: Register {}

/// A register that software can write.
pub trait Writable: Register {}

/// Where a register of type `T` is: its byte offset from the base of the map.
pub struct Reg<T> {
    offset: u32,
    contents: PhantomData<fn() -> T>,
}

impl<T> Reg<T> {
    pub(crate) const fn new(offset: u32) -> Self {
        Self { offset, contents: PhantomData }
    }

    /// The byte offset from the base of the map; a multiple of 4.
    pub const fn offset(self) -> u32 {
        self.offset
    }
}

impl<T> Clone for Reg<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Reg<T> {}

impl<T> PartialEq for Reg<T> {
    fn eq(&self, other: &Self) -> bool {
        self.offset == other.offset
    }
}

impl<T> Eq for Reg<T> {}

impl<T> fmt::Debug for Reg<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Reg({:#05x})", self.offset)
    }
}

/// Field bits that this version of the map gives no meaning.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct UnknownValue(pub u32);

impl fmt::Display for UnknownValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "value {} has no meaning in this version of the register map", self.0)
    }
}

impl core::error::Error for UnknownValue {}

/// What software may do to a field.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Access {
    /// Reads as its reset value, always.
    Constant,
    /// Driven by hardware; writing it is a bus error.
    ReadOnly,
    /// Holds what was last written.
    ReadWrite,
    /// Set by hardware; writing 1 clears a bit, writing 0 leaves it.
    WriteOneToClear,
    /// Writing 1 triggers an action; reads as 0.
    WriteOneToPulse,
}

/// One field, for tools and fakes that walk the map.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct FieldInfo {
    /// Name within the register.
    pub name: &'static str,
    /// Lowest bit.
    pub lsb: u8,
    /// Number of bits, 1 to 32.
    pub width: u8,
    /// What software may do to it.
    pub access: Access,
    /// Whether a write has no effect while a job runs.
    pub locked: bool,
}

impl FieldInfo {
    pub(crate) const fn new(
        name: &'static str,
        lsb: u8,
        width: u8,
        access: Access,
        locked: bool,
    ) -> Self {
        Self { name, lsb, width, access, locked }
    }

    /// The field's bits, as ones.
    pub const fn mask(&self) -> u32 {
        ones(self.width as u32) << self.lsb
    }
}

/// One register, for tools and fakes that walk the map.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct RegisterInfo {
    /// Dotted path in the SystemRDL source.
    pub path: &'static str,
    /// Byte offset from the base of the map.
    pub offset: u32,
    /// Bus word after power-up; fields that hardware drives are 0 here.
    pub reset: u32,
    /// Fields by ascending bit.
    pub fields: &'static [FieldInfo],
}

impl RegisterInfo {
    pub(crate) const fn new<T: Register>(path: &'static str, at: Reg<T>) -> Self {
        Self { path, offset: at.offset, reset: T::RESET_BITS, fields: T::FIELDS }
    }

    /// The register at byte `offset`, or `None` where the map has a hole.
    pub fn at(offset: u32) -> Option<&'static Self> {
        let index = crate::REGISTERS.binary_search_by_key(&offset, |r| r.offset).ok()?;
        crate::REGISTERS.get(index)
    }

    /// The bits of all fields whose access `is` one of those wanted, as ones.
    pub fn mask(&self, is: impl Fn(Access) -> bool) -> u32 {
        self.fields.iter().filter(|f| is(f.access)).fold(0, |mask, f| mask | f.mask())
    }

    /// The bits that a write can change or trigger, as ones; 0 for a read-only register.
    pub fn writable(&self) -> u32 {
        self.mask(|access| !matches!(access, Access::Constant | Access::ReadOnly))
    }

    /// The bits that read back, as ones; 0 for a write-only register.
    pub fn readable(&self) -> u32 {
        self.mask(|access| access != Access::WriteOneToPulse)
    }

    /// The bits that a write cannot change while a job runs, as ones.
    pub fn locked(&self) -> u32 {
        self.fields.iter().filter(|f| f.locked).fold(0, |mask, f| mask | f.mask())
    }
}

/// Bits `lsb .. lsb + width` of `word`.
pub(crate) const fn get(word: u32, lsb: u32, width: u32) -> u32 {
    (word >> lsb) & ones(width)
}

/// `word` with bits `lsb .. lsb + width` replaced by the low bits of `value`.
pub(crate) const fn set(word: u32, lsb: u32, width: u32, value: u32) -> u32 {
    let mask = ones(width) << lsb;
    (word & !mask) | ((value << lsb) & mask)
}

const fn ones(width: u32) -> u32 {
    u32::MAX >> (32 - width)
}
