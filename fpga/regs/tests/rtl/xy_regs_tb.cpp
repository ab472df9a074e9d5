// Runs the commands on standard input against the register block, one answer line each:
//   r OFFSET          read:  "VALUE" or "error"
//   w OFFSET VALUE    write: "ok" or "error", then how many cycles `start` was high
//   b 0|1             drives status.busy
//   d                 pulses int_status.done for one cycle
//   i                 "0" or "1": the interrupt line
// Numbers are hexadecimal.
#include <cstdio>
#include <iostream>
#include <string>

#include "Vxy_regs_tb.h"

static Vxy_regs_tb top;
static unsigned start_cycles;

static void tick() {
    top.clk_i = 0;
    top.eval();
    start_cycles += top.start_o;
    top.clk_i = 1;
    top.eval();
}

static bool access(bool write, uint32_t offset, uint32_t value, uint32_t *read) {
    start_cycles = 0;
    top.req_i = 1;
    top.write_i = write;
    top.addr_i = offset;
    top.wdata_i = value;
    bool error = true;
    for (int cycle = 0; cycle < 100; ++cycle) {
        top.clk_i = 0;
        top.eval();
        if (top.ack_o) {
            error = top.error_o;
            *read = top.rdata_o;
            break;
        }
        tick();
    }
    tick();
    top.req_i = 0;
    for (int cycle = 0; cycle < 4; ++cycle) tick();
    return !error;
}

int main() {
    top.rst_ni = 0;
    tick();
    top.rst_ni = 1;
    tick();
    std::string command;
    while (std::cin >> command >> std::hex) {
        uint32_t offset, value = 0;
        if (command == "r") {
            std::cin >> offset;
            if (access(false, offset, 0, &value)) std::printf("%x\n", value);
            else std::puts("error");
        } else if (command == "w") {
            std::cin >> offset >> value;
            bool ok = access(true, offset, value, &value);
            std::printf("%s %u\n", ok ? "ok" : "error", start_cycles);
        } else if (command == "b") {
            std::cin >> offset;
            top.busy_i = offset;
            tick();
            std::puts("ok");
        } else if (command == "d") {
            top.done_i = 1;
            tick();
            top.done_i = 0;
            tick();
            std::puts("ok");
        } else if (command == "i") {
            std::printf("%d\n", top.irq_o);
        } else {
            std::fprintf(stderr, "unknown command %s\n", command.c_str());
            return 1;
        }
    }
    return 0;
}
