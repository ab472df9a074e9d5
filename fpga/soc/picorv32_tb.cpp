// Test bench around PicoRV32: memory that answers within the cycle, a UART on standard output, a power
// switch, and where XY_TOP is defined the accelerator (accelerator.h). The memory map is that of
// fpga/firmware/src/map.rs.
//
//   Vpicorv32 LOCAL_IMAGE EXTERNAL_IMAGE PROTECTED_END LATENCY
//
// LOCAL_IMAGE is local memory as the loader leaves it; no store below PROTECTED_END (decimal) is
// allowed. EXTERNAL_IMAGE starts external memory, which answers the accelerator's reads after LATENCY
// cycles (the core has a port of its own). The last line on standard error is
// `CYCLES power-off WORD` or `CYCLES crash TEXT`, cycles counted from the end of reset.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "Vpicorv32.h"
#include "verilated.h"
#ifdef XY_TOP
#include "accelerator.h"
#endif

namespace {

constexpr uint32_t kPowerOff = 0x00100000;
constexpr uint32_t kUart = 0x10000000;
constexpr uint32_t kUartStatusWord = kUart + 4;
constexpr uint32_t kUartReady = 0x60 << 8;  // bits of byte 5, as seen in the word at 4
constexpr uint32_t kAccelerator = 0x40000000;
constexpr uint32_t kAcceleratorSize = 512;
constexpr uint32_t kInterrupt = 0x40000800;
constexpr uint32_t kLocalBase = 0x80000000;
constexpr uint32_t kLocalSize = 8u << 20;
constexpr uint32_t kExternalBase = 0x80800000;
constexpr uint32_t kExternalSize = 56u << 20;

static_assert(kLocalBase + kLocalSize == kExternalBase, "memory is one array");

class Bench {
  public:
    Bench(const char *local, const char *external, uint32_t protected_end, unsigned latency)
        : memory_((kLocalSize + kExternalSize) / 4),
#ifdef XY_TOP
          accelerator_(reinterpret_cast<uint8_t *>(memory_.data()) + kLocalSize, kExternalBase,
                       kExternalSize, latency),
#endif
          protected_end_(protected_end) {
        (void)latency;
        load(local, 0, kLocalSize);
        load(external, kLocalSize, kExternalSize);
    }

    int run() {
        core_.clk = 0;
        core_.resetn = 0;
        core_.mem_ready = 0;
        for (int i = 0; i < 8; ++i) clock();
        core_.resetn = 1;
        for (;; ++cycles_) {
            clock();
            if (core_.trap) return crash("the core trapped", last_fetch_);
            core_.mem_ready = 0;
            if (core_.mem_valid) {
                if (in_accelerator(core_.mem_addr)) {
                    core_.mem_ready = reach();
                } else {
                    if (!serve()) return 1;
                    core_.mem_ready = 1;
                }
            }
#ifdef XY_TOP
            accelerator_.clock();
            if (accelerator_.complaint()) return crash(accelerator_.complaint(), 0);
#endif
            if (off_) {
                std::fflush(stdout);
                std::fprintf(stderr, "%llu power-off %u\n", (unsigned long long)cycles_, word_);
                return 0;
            }
        }
    }

  private:
    void clock() {
        core_.clk = 1;
        core_.eval();
        core_.clk = 0;
        core_.eval();
    }

    void load(const char *path, uint32_t offset, uint32_t size) {
        std::FILE *file = std::fopen(path, "rb");
        if (!file) {
            std::fprintf(stderr, "cannot read %s\n", path);
            std::exit(2);
        }
        std::fread(reinterpret_cast<char *>(memory_.data()) + offset, 1, size, file);
        std::fclose(file);
    }

    static bool in_accelerator(uint32_t addr) { return addr - kAccelerator < kAcceleratorSize; }

    // Lets the accelerator answer the access under way; true once it has. Where there is none, 0 is read
    // and nothing written.
    bool reach() {
        uint32_t value = 0;
#ifdef XY_TOP
        if (!accelerator_.access(core_.mem_addr - kAccelerator, core_.mem_wstrb, core_.mem_wdata, value)) {
            return false;
        }
#endif
        core_.mem_rdata = value;
        return true;
    }

    bool interrupt() const {
#ifdef XY_TOP
        return accelerator_.irq();
#else
        return false;
#endif
    }

    // Answers the access under way, or says why it cannot be.
    bool serve() {
        const uint32_t addr = core_.mem_addr;
        const uint32_t strobe = core_.mem_wstrb;
        if (core_.mem_instr) last_fetch_ = addr;
        if (addr >= kLocalBase && addr - kLocalBase < kLocalSize + kExternalSize) {
            uint32_t &word = memory_[(addr - kLocalBase) / 4];
            if (strobe == 0) {
                core_.mem_rdata = word;
                return true;
            }
            if (addr < protected_end_) {
                crash("a store into code or constants (did the stack overflow?) at", addr);
                return false;
            }
            uint32_t mask = 0;
            for (int i = 0; i < 4; ++i) {
                if (strobe >> i & 1) mask |= 0xffu << (8 * i);
            }
            word = (word & ~mask) | (core_.mem_wdata & mask);
            return true;
        }
        if (addr == kUartStatusWord && strobe == 0) {
            core_.mem_rdata = kUartReady;
            return true;
        }
        if (addr == kInterrupt && strobe == 0) {
            core_.mem_rdata = interrupt();
            return true;
        }
        if (addr == kUart && strobe == 1) {
            const int byte = core_.mem_wdata & 0xff;
            std::putchar(byte);
            // Frames end with a zero; whoever stops this bench sees all whole frames.
            if (byte == 0) std::fflush(stdout);
            return true;
        }
        if (addr == kPowerOff && strobe == 0xf) {
            off_ = true;
            word_ = core_.mem_wdata;
            return true;
        }
        crash(strobe ? "a store to nowhere at" : "a load from nowhere at", addr);
        return false;
    }

    int crash(const char *what, uint32_t addr) {
        std::fflush(stdout);
        std::fprintf(stderr, "%llu crash %s %#010x, after the fetch from %#010x\n",
                     (unsigned long long)cycles_, what, addr, last_fetch_);
        return 1;
    }

    Vpicorv32 core_;
    std::vector<uint32_t> memory_;
#ifdef XY_TOP
    Accelerator accelerator_;
#endif
    uint32_t protected_end_;
    uint32_t last_fetch_ = 0;
    uint64_t cycles_ = 0;
    bool off_ = false;
    uint32_t word_ = 0;
};

}  // namespace

int main(int argc, char **argv) {
    if (argc != 5) {
        std::fprintf(stderr, "usage: %s LOCAL_IMAGE EXTERNAL_IMAGE PROTECTED_END LATENCY\n", argv[0]);
        return 2;
    }
    static Bench bench(argv[1], argv[2], std::strtoul(argv[3], nullptr, 10),
                       std::strtoul(argv[4], nullptr, 10));
    return bench.run();
}
