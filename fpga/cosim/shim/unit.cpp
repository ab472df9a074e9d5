// C interface to a verilated unit, for xylem-cosim's `rtl` module.
//
// Keeps only what a test bench must: the clock, the reset and the waveform file. What each cycle's
// outputs should be is not known here. `ports.h` is made from the header that Verilator writes; it
// names the unit's class and has, for its inputs and outputs, a table and a function that copies
// them from or to 32-bit words, lowest first, one port after the other.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "verilated.h"
#include "verilated_vcd_c.h"

namespace {

template <class Pin>
void put(Pin& pin, const uint32_t*& words) {
    pin = static_cast<Pin>(*words++);
}
void put(QData& pin, const uint32_t*& words) {
    pin = words[0] | static_cast<QData>(words[1]) << 32;
    words += 2;
}
template <std::size_t Words>
void put(VlWide<Words>& pin, const uint32_t*& words) {
    for (std::size_t i = 0; i < Words; ++i) pin[i] = *words++;
}

template <class Pin>
void get(const Pin& pin, uint32_t*& words) {
    *words++ = pin;
}
void get(const QData& pin, uint32_t*& words) {
    *words++ = static_cast<uint32_t>(pin);
    *words++ = static_cast<uint32_t>(pin >> 32);
}
template <std::size_t Words>
void get(const VlWide<Words>& pin, uint32_t*& words) {
    for (std::size_t i = 0; i < Words; ++i) *words++ = pin[i];
}

#include "ports.h"

// Set when an assertion of the RTL fails; the run goes on and the caller is told.
thread_local std::string failure;

void fail(const char* file, int line, const char* what) {
    if (failure.empty()) failure = std::string(file) + ":" + std::to_string(line) + ": " + what;
}

struct Bench {
    std::unique_ptr<VerilatedContext> context{new VerilatedContext};
    std::unique_ptr<Unit> unit;
    std::unique_ptr<VerilatedVcdC> waves;

    // One half cycle: 5 time units of the waveform.
    void half(bool clock) {
        unit->clk_i = clock;
        unit->eval();
        if (waves) waves->dump(context->time());
        context->timeInc(5);
    }
};

// The bench behind a handle. Verilator works on what it takes for its thread's context, the one made
// last, which may be another bench's and gone.
Bench* enter(void* handle) {
    auto* bench = static_cast<Bench*>(handle);
    Verilated::threadContextp(bench->context.get());
    return bench;
}

}  // namespace

// Verilator's own versions end the process.
void vl_stop(const char* file, int line, const char*) VL_MT_UNSAFE {
    fail(file, line, "assertion failed");
}
void vl_fatal(const char* file, int line, const char*, const char* message) VL_MT_UNSAFE {
    fail(file, line, message);
}
void vl_finish(const char* file, int line, const char*) VL_MT_UNSAFE { fail(file, line, "$finish"); }

extern "C" {

// The ports: lines of `in NAME BITS` and `out NAME BITS`.
const char* xy_ports() { return ports; }

// A unit after reset, all other inputs 0. Registers without a reset and memories start with random
// values from `seed`.
void* xy_new(uint32_t seed) {
    failure.clear();
    auto* bench = new Bench;
    // Units are built without threads, so no pool of them is wanted.
    bench->context->threads(1);
    bench->context->randReset(2);
    bench->context->randSeed(static_cast<int>(seed % 0x7fffffffu) + 1);
    bench->context->traceEverOn(true);
    bench->context->assertOn(true);
    bench->unit.reset(new Unit{bench->context.get()});
    const uint32_t zeros[input_words + 1] = {};
    put_inputs(*bench->unit, zeros);
    bench->unit->rst_ni = 1;
    bench->unit->clk_i = 0;
    bench->unit->eval();
    bench->unit->rst_ni = 0;
    for (int i = 0; i < 2; ++i) {
        bench->half(true);
        bench->half(false);
    }
    bench->unit->rst_ni = 1;
    bench->unit->eval();
    failure.clear();
    return bench;
}

void xy_free(void* handle) {
    auto* bench = enter(handle);
    if (bench->waves) bench->waves->close();
    bench->unit->final();
    delete bench;
}

// The outputs that stand once the inputs are given, before the edge; may be called again with other
// inputs in the same cycle.
void xy_settle(void* handle, const uint32_t* in, uint32_t* out) {
    auto& unit = *enter(handle)->unit;
    put_inputs(unit, in);
    unit.clk_i = 0;
    unit.eval();
    get_outputs(unit, out);
}

// The rest of the cycle, edge included. Returns nonzero if an assertion failed.
int xy_edge(void* handle) {
    auto* bench = enter(handle);
    bench->half(false);
    bench->half(true);
    return failure.empty() ? 0 : 1;
}

// Holds the unit in reset for this cycle and the next.
void xy_reset(void* handle) {
    auto* bench = enter(handle);
    bench->unit->rst_ni = 0;
    for (int i = 0; i < 2; ++i) {
        bench->half(false);
        bench->half(true);
    }
    bench->unit->rst_ni = 1;
}

// Starts writing a VCD file with the next cycle.
void xy_waves(void* handle, const char* path) {
    auto* bench = enter(handle);
    bench->waves.reset(new VerilatedVcdC);
    bench->unit->trace(bench->waves.get(), 99);
    bench->waves->open(path);
}

// What failed, for as long as this thread makes no other call.
const char* xy_failure() { return failure.c_str(); }
}
