// Test bench around xy_vexriscv: memory that answers within the cycle on both buses, a UART on standard
// output, a power switch. The memory map is that of fpga/custom/src/map.rs.
//
//   Vbench PROGRAM SCENE CYCLES
//
// PROGRAM is an ELF file, SCENE starts external memory, and after so many CYCLES the run is given up. The last
// line on standard error is `CYCLES power-off WORD` or `CYCLES crash TEXT`, cycles counted from the end of
// reset.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "Vbench.h"
#include "verilated.h"

namespace {

constexpr uint32_t kBase = 0x40000000;
constexpr uint32_t kLocalSize = 8u << 20;
constexpr uint32_t kSize = 64u << 20;  // local memory, then external memory
constexpr uint32_t kUart = 0xf0000000;
constexpr uint32_t kPowerOff = 0xf0000004;

[[noreturn]] void refuse(const char *what, const char *path) {
    std::fprintf(stderr, "%s %s\n", what, path);
    std::exit(2);
}

std::vector<uint8_t> read(const char *path) {
    std::FILE *file = std::fopen(path, "rb");
    if (!file) refuse("cannot read", path);
    std::vector<uint8_t> bytes;
    uint8_t part[65536];
    while (std::size_t got = std::fread(part, 1, sizeof part, file)) bytes.insert(bytes.end(), part, part + got);
    std::fclose(file);
    return bytes;
}

class Bench {
  public:
    Bench(const char *program, const char *scene) : memory_(kSize / 4) {
        load_program(program);
        const std::vector<uint8_t> bytes = read(scene);
        if (bytes.size() > kSize - kLocalSize) refuse("too large:", scene);
        std::memcpy(at(kBase + kLocalSize), bytes.data(), bytes.size());
    }

    int run(uint64_t limit) {
        core_.boot_i = kBase;
        core_.rst_ni = 0;
        for (int i = 0; i < 8; ++i) clock();
        core_.rst_ni = 1;
        for (; cycles_ < limit; ++cycles_) {
            clock();
            if (wrong_) return crash(wrong_, where_);
            if (off_) {
                std::fflush(stdout);
                std::fprintf(stderr, "%llu power-off %u\n", (unsigned long long)cycles_, word_);
                return 0;
            }
        }
        return crash("the run was given up, at", core_.fetch_addr_o << 2);
    }

  private:
    // A cycle: an edge, then both buses are answered, so that the next edge takes the answers.
    void clock() {
        core_.clk_i = 1;
        core_.eval();
        core_.fetch_ack_i = core_.fetch_o;
        if (core_.fetch_o) core_.fetch_data_i = *word(core_.fetch_addr_o, "a fetch from nowhere at");
        core_.access_ack_i = core_.access_o;
        if (core_.access_o) access();
        core_.clk_i = 0;
        core_.eval();
    }

    void access() {
        const uint32_t addr = core_.access_addr_o << 2;
        if (addr == kUart && core_.access_write_o) {
            std::putchar(core_.access_data_o & 0xff);
        } else if (addr == kPowerOff && core_.access_write_o) {
            off_ = true;
            word_ = core_.access_data_o;
        } else if (!core_.access_write_o) {
            core_.access_data_i = *word(core_.access_addr_o, "a load from nowhere at");
        } else {
            uint32_t mask = 0;
            for (int i = 0; i < 4; ++i) {
                if (core_.access_strb_o >> i & 1) mask |= 0xffu << (8 * i);
            }
            uint32_t *word = this->word(core_.access_addr_o, "a store to nowhere at");
            *word = (*word & ~mask) | (core_.access_data_o & mask);
        }
    }

    // A word of memory; outside of it, one that does not count.
    uint32_t *word(uint32_t number, const char *wrong) {
        static uint32_t nowhere;
        const uint32_t index = number - kBase / 4;
        if (index < kSize / 4) return &memory_[index];
        // Not before the first instruction.
        if (core_.rst_ni && !wrong_) wrong_ = wrong, where_ = number << 2;
        return &nowhere;
    }

    uint8_t *at(uint32_t addr) { return reinterpret_cast<uint8_t *>(memory_.data()) + (addr - kBase); }

    void load_program(const char *path) {
        const std::vector<uint8_t> file = read(path);
        const auto half = [&](std::size_t at) { return uint32_t(file.at(at)) | uint32_t(file.at(at + 1)) << 8; };
        const auto word = [&](std::size_t at) { return half(at) | half(at + 2) << 16; };
        // A 32-bit little-endian ELF file for RISC-V.
        if (file.size() < 52 || std::memcmp(file.data(), "\x7f" "ELF\1\1", 6) != 0 || half(18) != 243) {
            refuse("no RISC-V program:", path);
        }
        if (word(24) != kBase) refuse("does not start where the core does:", path);
        for (uint32_t i = 0; i < half(44); ++i) {
            const std::size_t header = word(28) + i * half(42);
            const uint32_t offset = word(header + 4), addr = word(header + 8), size = word(header + 16);
            if (word(header) != 1 || size == 0) continue;
            if (addr - kBase >= kLocalSize || size > kLocalSize - (addr - kBase) || offset + size > file.size()) {
                refuse("a segment outside local memory:", path);
            }
            std::memcpy(at(addr), file.data() + offset, size);
        }
    }

    int crash(const char *what, uint32_t addr) {
        std::fflush(stdout);
        std::fprintf(stderr, "%llu crash %s %#010x\n", (unsigned long long)cycles_, what, addr);
        return 1;
    }

    Vbench core_;
    std::vector<uint32_t> memory_;
    uint64_t cycles_ = 0;
    const char *wrong_ = nullptr;
    uint32_t where_ = 0;
    bool off_ = false;
    uint32_t word_ = 0;
};

}  // namespace

int main(int argc, char **argv) {
    if (argc != 4) {
        std::fprintf(stderr, "usage: %s PROGRAM SCENE CYCLES\n", argv[0]);
        return 2;
    }
    static Bench bench(argv[1], argv[2]);
    return bench.run(std::strtoull(argv[3], nullptr, 10));
}
