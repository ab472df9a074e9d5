// C interface to the verilated xy_heap, for xylem-cosim's `rtl` module.
//
// Keeps only what a test bench must: the clock, the reset and the waveform file. What each cycle's
// outputs should be is not known here.

#include <cstdint>
#include <memory>
#include <string>

#include "Vxy_heap.h"
#include "verilated.h"
#include "verilated_vcd_c.h"

namespace {

// Set when an assertion of the RTL fails; the run goes on and the caller is told.
thread_local std::string failure;

struct Bench {
    std::unique_ptr<VerilatedContext> context{new VerilatedContext};
    std::unique_ptr<Vxy_heap> heap;
    std::unique_ptr<VerilatedVcdC> waves;

    // One half cycle: 5 time units of the waveform.
    void half(bool clock) {
        heap->clk_i = clock;
        heap->eval();
        if (waves) waves->dump(context->time());
        context->timeInc(5);
    }
};

}  // namespace

// Verilator's own versions end the process.
void vl_stop(const char* file, int line, const char*) VL_MT_UNSAFE {
    if (failure.empty()) failure = std::string(file) + ":" + std::to_string(line) + ": assertion failed";
}
void vl_fatal(const char* file, int line, const char*, const char* message) VL_MT_UNSAFE {
    if (failure.empty()) failure = std::string(file) + ":" + std::to_string(line) + ": " + message;
}
void vl_finish(const char* file, int line, const char*) VL_MT_UNSAFE {
    if (failure.empty()) failure = std::string(file) + ":" + std::to_string(line) + ": $finish";
}

extern "C" {

struct HeapIn {
    uint64_t key;
    uint32_t slot;
    uint8_t valid;
    uint8_t op;
};

struct HeapOut {
    uint64_t top_key;
    uint32_t top_slot;
    uint8_t ready;
    uint8_t error;
    uint8_t top_valid;
    uint8_t full;
};

// A heap after reset. Registers without a reset and memories start with random values from `seed`.
void* xy_heap_new(uint32_t seed) {
    failure.clear();
    auto* bench = new Bench;
    bench->context->randReset(2);
    bench->context->randSeed(static_cast<int>(seed % 0x7fffffffu) + 1);
    bench->context->traceEverOn(true);
    bench->context->assertOn(true);
    bench->heap.reset(new Vxy_heap{bench->context.get()});
    bench->heap->op_valid_i = 0;
    bench->heap->rst_ni = 1;
    bench->heap->clk_i = 0;
    bench->heap->eval();
    bench->heap->rst_ni = 0;
    for (int i = 0; i < 2; ++i) {
        bench->half(true);
        bench->half(false);
    }
    bench->heap->rst_ni = 1;
    bench->heap->eval();
    failure.clear();
    return bench;
}

void xy_heap_free(void* handle) {
    auto* bench = static_cast<Bench*>(handle);
    if (bench->waves) bench->waves->close();
    bench->heap->final();
    delete bench;
}

// One clock cycle: gives the inputs, reports the outputs that stand during it, then the edge.
// Returns nonzero if an assertion failed.
int xy_heap_tick(void* handle, const HeapIn* in, HeapOut* out) {
    auto* bench = static_cast<Bench*>(handle);
    auto& heap = *bench->heap;
    heap.op_valid_i = in->valid;
    heap.op_i = in->op;
    heap.op_key_i = in->key;
    heap.op_slot_i = in->slot;
    bench->half(false);
    out->top_key = heap.top_key_o;
    out->top_slot = heap.top_slot_o;
    out->ready = heap.op_ready_o;
    out->error = heap.op_error_o;
    out->top_valid = heap.top_valid_o;
    out->full = heap.full_o;
    bench->half(true);
    return failure.empty() ? 0 : 1;
}

// Starts writing a VCD file with the next cycle.
void xy_heap_waves(void* handle, const char* path) {
    auto* bench = static_cast<Bench*>(handle);
    bench->waves.reset(new VerilatedVcdC);
    bench->heap->trace(bench->waves.get(), 99);
    bench->waves->open(path);
}

// What failed, for as long as this thread makes no other call.
const char* xy_heap_failure() { return failure.c_str(); }
}
