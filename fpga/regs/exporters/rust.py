"""Prints the map as the Rust module `src/map.rs`; the types it uses are in `src/register.rs`."""

from model import CONSTANT, READ_ONLY, WRITE_ONE_TO_PULSE

HEADER = """\
// Generated from fpga/regs/xylem.rdl by fpga/regs/generate.sh. Do not edit.

//! The generated map: where each register is, and what it holds.

use crate::register::{Access, FieldInfo, Readable, Reg, Register, RegisterInfo};
use crate::register::{UnknownValue, Writable, get, set};
"""

ACCESS_WORDS = {
    "Constant": "constant",
    "ReadOnly": "read-only",
    "ReadWrite": "read-write",
    "WriteOneToClear": "write 1 to clear",
    "WriteOneToPulse": "write 1 to trigger, reads as 0",
}


def print_rust(m):
    parts = [HEADER]
    parts.append(f"/// Bytes of address space that the map takes, from offset 0 on.\npub const MAP_SIZE: u32 = {m.size:#x};\n")
    parts += [address(r) for r in m.registers]
    parts += [enum(e) for e in m.enums]
    parts += [register_type(r) for r in m.types]
    parts.append(metadata(m))
    return "\n".join(parts)


def camel(name):
    return "".join(word.capitalize() for word in name.split("_"))


def type_of(register):
    return camel(register.type_name)


def constant(register):
    return register.path.replace(".", "_").upper()


def address(r):
    note = f" {r.group_doc}" if r.group_doc else ""
    return f"/// `{r.path}`: {r.doc}{note}\npub const {constant(r)}: Reg<{type_of(r)}> = Reg::new({r.offset:#05x});\n"


def enum(e):
    name = camel(e.name)
    variants = "".join(f"    /// {v.doc}\n    {camel(v.name)} = {v.number},\n" for v in e.values)
    arms = "".join(f"            {v.number} => Ok(Self::{camel(v.name)}),\n" for v in e.values)
    names = "".join(f"            Self::{camel(v.name)} => \"{v.name}\",\n" for v in e.values)
    every = ", ".join(f"Self::{camel(v.name)}" for v in e.values)
    return f"""\
/// Values of fields encoded as `{e.name}`.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum {name} {{
{variants}}}

impl {name} {{
    /// Every value, in ascending order.
    pub const ALL: [Self; {len(e.values)}] = [{every}];

    /// The value that `bits` encode.
    ///
    /// # Errors
    /// [`UnknownValue`] if this version of the map gives `bits` no meaning.
    pub const fn from_bits(bits: u32) -> Result<Self, UnknownValue> {{
        match bits {{
{arms}            _ => Err(UnknownValue(bits)),
        }}
    }}

    /// The name in the register map.
    pub const fn name(self) -> &'static str {{
        match self {{
{names}        }}
    }}
}}

impl core::fmt::Display for {name} {{
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {{
        f.write_str(self.name())
    }}
}}
"""


def register_type(r):
    name = type_of(r)
    readable = any(f.access != WRITE_ONE_TO_PULSE for f in r.fields)
    writable = any(f.access not in (CONSTANT, READ_ONLY) for f in r.fields)
    traits = "".join(f"\nimpl {t} for {name} {{}}\n" for t, is_so in (("Readable", readable), ("Writable", writable)) if is_so)
    fields = "".join(
        f"FieldInfo::new(\"{f.name}\", {f.lsb}, {f.width}, Access::{f.access}{', true' if f.locked else ', false'}),"
        for f in r.fields
    )
    methods = "\n".join(method for f in r.fields for method in field_methods(f))
    return f"""\
/// {r.title}. {r.type_doc}
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct {name}(u32);

impl Register for {name} {{
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = {r.reset:#x};
    const FIELDS: &'static [FieldInfo] = &[{fields}];

    fn from_bits(bits: u32) -> Self {{
        Self(bits)
    }}

    fn bits(self) -> u32 {{
        self.0
    }}
}}
{traits}
impl {name} {{
{methods}}}
"""


def field_methods(f):
    """The getter and the setter of a field, as far as its access allows them."""
    if f.signed and f.width != 32:
        raise SystemExit(f"{f.name}: signed fields are 32 bits wide")
    place = f"{f.lsb}, {f.width}"
    if f.enum:
        kind = camel(f.enum.name)
        result, read, written = f"Result<{kind}, UnknownValue>", f"{kind}::from_bits(get(self.0, {place}))", "value as u32"
    elif f.width == 1:
        kind = result = "bool"
        read, written = f"get(self.0, {place}) != 0", "value as u32"
    else:
        kind = result = ("i" if f.signed else "u") + str(next(w for w in (8, 16, 32) if f.width <= w))
        read, written = f"get(self.0, {place})", "value"
        if kind != "u32":
            read, written = f"{read} as {kind}", "value as u32"

    bits = f"Bit {f.lsb}" if f.width == 1 else f"Bits {f.lsb + f.width - 1}:{f.lsb}"
    doc = f"{f.doc} ({bits}, {ACCESS_WORDS[f.access]}{', locked while busy' if f.locked else ''}.)"
    if f.access != WRITE_ONE_TO_PULSE:
        errors = "///\n/// # Errors\n/// [`UnknownValue`] if the map gives the bits no meaning.\n" if f.enum else ""
        yield f"/// {doc}\n{errors}pub const fn {f.name}(self) -> {result} {{ {read} }}\n"
    if f.access not in (CONSTANT, READ_ONLY):
        yield (
            f"/// Sets `{f.name}`. {doc}\n#[must_use]\n"
            f"pub const fn with_{f.name}(self, value: {kind}) -> Self {{ Self(set(self.0, {place}, {written})) }}\n"
        )


def metadata(m):
    entries = "".join(f"RegisterInfo::new(\"{r.path}\", {constant(r)})," for r in m.registers)
    return f"""\
/// Every register of the map, by ascending offset.
pub const REGISTERS: [RegisterInfo; {len(m.registers)}] = [{entries}];
"""
