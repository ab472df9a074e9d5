"""Prints the map as one page of Markdown."""

ACCESS_WORDS = {
    "Constant": "constant",
    "ReadOnly": "ro",
    "ReadWrite": "rw",
    "WriteOneToClear": "rw1c",
    "WriteOneToPulse": "w1p",
}


def print_markdown(m):
    lines = [
        "<!-- Generated from fpga/regs/xylem.rdl by fpga/regs/generate.sh. Do not edit. -->",
        "",
        "# Registers",
        "",
        f"{m.doc}",
        f"32-bit registers, {m.size:#x} bytes. Access kinds: `ro` read-only, `constant` never changes,",
        "`rw` read-write, `rw1c` write 1 to clear, `w1p` write 1 to trigger (reads as 0), `lock` a write has no effect",
        "while busy. Bits that no field names are reserved: they read as 0 and are written as 0.",
        "",
        "| Offset | Register | What it is |",
        "|---|---|---|",
    ]
    for r in m.registers:
        lines.append(f"| {r.offset:#05x} | [`{r.path}`](#{r.type_name}) | {summary(r)} |")
    for r in m.types:
        places = ", ".join(f"`{o.path}` at {o.offset:#05x}" for o in m.registers if o.type_name == r.type_name)
        lines += ["", f"## {r.type_name}", "", f"{places}.", "", r.type_doc, ""]
        lines += ["| Bits | Field | Access | Reset | Meaning |", "|---|---|---|---|---|"]
        lines += [row(f) for f in r.fields]
    for e in m.enums:
        lines += ["", f"## enum {e.name}", "", "| Value | Name | Meaning |", "|---|---|---|"]
        lines += [f"| {v.number} | `{v.name}` | {v.doc} |" for v in e.values]
    return "\n".join(lines) + "\n"


def summary(r):
    """What tells a register from the others of its type, else its title."""
    specific = r.doc if r.doc != r.type_doc else r.title + "."
    return f"{r.group_doc.removesuffix('.')}: {specific[0].lower()}{specific[1:]}" if r.group_doc else specific


def row(f):
    bits = str(f.lsb) if f.width == 1 else f"{f.lsb + f.width - 1}:{f.lsb}"
    access = ACCESS_WORDS[f.access] + (" lock" if f.locked else "")
    reset = "" if f.reset is None else f"{f.reset:#x}"
    encoded = f" See [`{f.enum.name}`](#enum-{f.enum.name})." if f.enum else ""
    return f"| {bits} | `{f.name}` | {access} | {reset} | {f.doc}{encoded} |"
