// xy_top beside the core, for picorv32_tb.cpp: its registers on AXI4-Lite, its AXI4 master on the bench's
// memory.
//
// Memory takes every address and every line of data at once. A read is answered a fixed number of cycles
// later, one line a cycle; a write in the next cycle. What lies outside memory is answered with DECERR.
//
// Both clocks are the same, but the accelerator's stands still while it is idle and not addressed: nothing
// in it changes then, as it has no timer that runs while idle, and simulation is the faster for it. It
// wakes for a register access and a few cycles after it, and from a start, an abort or a reset until its
// interrupt rises; software that enables no interrupt keeps it awake.
#pragma once

#include <cstdint>
#include <cstring>
#include <deque>

#include "Vxy_top.h"

class Accelerator {
  public:
    // Memory of `size` bytes that the bus calls `base`.
    Accelerator(uint8_t *memory, uint32_t base, uint32_t size, unsigned latency)
        : memory_(memory), base_(base), size_(size), latency_(latency ? latency : 1) {
        top_.rst_ni = 0;
        for (int i = 0; i < 8; ++i) step();
        top_.rst_ni = 1;
    }

    bool irq() const { return top_.irq_o; }

    // What the bus did that it must not, or null.
    const char *complaint() const { return complaint_; }

    // The core's access in this cycle; true once it is done. `value` is what was read.
    bool access(uint32_t offset, uint32_t strobe, uint32_t data, uint32_t &value) {
        if (!asked_) {
            asked_ = true;
            awake_ = kMargin;
            if (strobe) {
                top_.s_axil_awvalid_i = 1;
                top_.s_axil_wvalid_i = 1;
                top_.s_axil_awaddr_i = offset;
                top_.s_axil_wdata_i = data;
                top_.s_axil_wstrb_i = strobe;
                if (offset == kCtrl && (data & 7)) busy_ = true;
            } else {
                top_.s_axil_arvalid_i = 1;
                top_.s_axil_araddr_i = offset;
            }
            return false;
        }
        if (!answered_) return false;
        asked_ = answered_ = false;
        value = answer_;
        return true;
    }

    // One cycle of the clock, or none while there is nothing to do.
    void clock() {
        if (awake_ == 0 && !busy_) return;
        if (awake_) --awake_;
        step();
        ++cycles_;
        if (busy_ && irq()) {
            busy_ = false;
            awake_ = kMargin;
        }
    }

    // Cycles that were simulated.
    uint64_t cycles() const { return cycles_; }

  private:
    static constexpr uint32_t kLine = 64;
    static constexpr uint32_t kCtrl = 0x40;
    static constexpr unsigned kMargin = 64;
    static constexpr unsigned kDecodeError = 3;

    struct Read {
        uint64_t due;
        uint32_t addr;
        uint32_t id;
    };

    struct Write {
        uint32_t addr;
        uint32_t id;
    };

    bool inside(uint32_t addr) const { return addr - base_ < size_; }

    void step() {
        // Inputs of this cycle, which do not depend on its outputs.
        top_.s_axil_bready_i = 1;
        top_.s_axil_rready_i = 1;
        top_.m_axi_arready_i = 1;
        top_.m_axi_awready_i = 1;
        top_.m_axi_wready_i = 1;
        const bool reads = !reads_.empty() && reads_.front().due <= now_;
        top_.m_axi_rvalid_i = reads;
        if (reads) {
            const Read &read = reads_.front();
            top_.m_axi_rid_i = read.id;
            top_.m_axi_rlast_i = 1;
            top_.m_axi_rresp_i = inside(read.addr) ? 0 : kDecodeError;
            if (inside(read.addr)) {
                std::memcpy(top_.m_axi_rdata_i.data(), memory_ + (read.addr - base_), kLine);
            } else {
                std::memset(top_.m_axi_rdata_i.data(), 0, kLine);
            }
        }
        top_.m_axi_bvalid_i = !written_.empty();
        if (!written_.empty()) {
            top_.m_axi_bid_i = written_.front().id;
            top_.m_axi_bresp_i = inside(written_.front().addr) ? 0 : kDecodeError;
        }
        top_.clk_i = 0;
        top_.eval();

        // What is handed over at the edge.
        if (top_.m_axi_bvalid_i && top_.m_axi_bready_o) written_.pop_front();
        if (reads && top_.m_axi_rready_o) reads_.pop_front();
        if (top_.m_axi_arvalid_o) {
            if (top_.m_axi_arlen_o) complaint_ = "a read of more than one beat";
            reads_.push_back({now_ + latency_, top_.m_axi_araddr_o, top_.m_axi_arid_o});
        }
        if (top_.m_axi_awvalid_o) {
            if (top_.m_axi_awlen_o) complaint_ = "a write of more than one beat";
            addresses_.push_back({top_.m_axi_awaddr_o, top_.m_axi_awid_o});
        }
        if (top_.m_axi_wvalid_o) {
            Line line;
            std::memcpy(line.bytes, top_.m_axi_wdata_o.data(), kLine);
            line.strobe = top_.m_axi_wstrb_o;
            lines_.push_back(line);
        }
        while (!addresses_.empty() && !lines_.empty()) write();
        if (top_.s_axil_awvalid_i && top_.s_axil_awready_o) aw_taken_ = true;
        if (top_.s_axil_wvalid_i && top_.s_axil_wready_o) w_taken_ = true;
        if (top_.s_axil_arvalid_i && top_.s_axil_arready_o) ar_taken_ = true;
        if (top_.s_axil_bvalid_o) answered_ = true;
        if (top_.s_axil_rvalid_o) {
            answered_ = true;
            answer_ = top_.s_axil_rdata_o;
        }

        top_.clk_i = 1;
        top_.eval();
        ++now_;
        if (aw_taken_) top_.s_axil_awvalid_i = 0;
        if (w_taken_) top_.s_axil_wvalid_i = 0;
        if (ar_taken_) top_.s_axil_arvalid_i = 0;
        aw_taken_ = w_taken_ = ar_taken_ = false;
    }

    // Puts the oldest line into memory.
    void write() {
        const Write to = addresses_.front();
        const Line &line = lines_.front();
        if (inside(to.addr)) {
            uint8_t *bytes = memory_ + (to.addr - base_);
            for (uint32_t i = 0; i < kLine; ++i) {
                if (line.strobe >> i & 1) bytes[i] = line.bytes[i];
            }
        }
        written_.push_back(to);
        addresses_.pop_front();
        lines_.pop_front();
    }

    struct Line {
        uint8_t bytes[kLine];
        uint64_t strobe;
    };

    Vxy_top top_;
    uint8_t *memory_;
    uint32_t base_, size_;
    unsigned latency_;
    uint64_t now_ = 0, cycles_ = 0;
    std::deque<Read> reads_;
    std::deque<Write> addresses_, written_;
    std::deque<Line> lines_;
    unsigned awake_ = 0;
    bool busy_ = false;
    bool asked_ = false, answered_ = false;
    bool aw_taken_ = false, w_taken_ = false, ar_taken_ = false;
    uint32_t answer_ = 0;
    const char *complaint_ = nullptr;
};
