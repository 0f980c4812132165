// SPDX-License-Identifier: MIT
// compbox pack: a coefficient file as it is flashed.
#include <fmt/core.h>

#include <memory>
#include <ostream>

#include "host-tools/coefficients/load.h"
#include "host-tools/command_line/summary.h"
#include "host-tools/compbox/commands.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"

extern "C" {
#include "firmware/config/config.h"
#include "firmware/load/slot.h"
}

namespace compbox {

namespace {

struct pack_arguments {
    std::string input, output;
    bool as_json = false;
};

// A file for compboxd is packed too, with a remark, because other microcontrollers may run it.
std::vector<std::string> remarks_on(const std::string &path, const std::string &text) {
    cb_message message = {};
    if (coefficients::load_coefficient_text(text, &message, coefficients::stm32f405_target))
        return {};
    return {fmt::format("{}: the STM32F405 will not run this file: {}, line {}, column {}", path,
                        message.text, message.line, message.column)};
}

// Puts where the status register is into the header of a slot, with a serial line.
void add_report(const cb_plc_config &plc, std::uint8_t *header) {
    if (plc.transport != CB_TRANSPORT_RTU) return;
    const cb_rtu_line &line = plc.serial.line;
    const cb_slot_report report = {line.baud,
                                   static_cast<std::uint16_t>(plc.write.start + plc.status),
                                   plc.unit, line.parity, line.stop_bits};
    cb_slot_set_report(header, &report);
}

constexpr unsigned most_bytes = unsigned{CB_SLOT_HEADER_BYTES} + CB_MAX_TEXT_BYTES;

// Writes the slot, header and text, of a file that the MCU's loader takes. Throws input_error.
void run_pack(const pack_arguments &arguments, const cli::streams &io) {
    std::string text;  // what was checked, and no second reading
    const auto config = coefficients::load_coefficients(arguments.input, &text);
    std::string slot(CB_SLOT_HEADER_BYTES, '\0');
    cb_slot_header(config->revision, text.data(), static_cast<std::uint32_t>(text.size()),
                   reinterpret_cast<std::uint8_t *>(slot.data()));
    add_report(config->plc, reinterpret_cast<std::uint8_t *>(slot.data()));
    slot += text;
    formats::write_file(arguments.output, slot, &io.out);
    const auto remarks = remarks_on(arguments.input, text);
    if (arguments.as_json) {
        return cli::print_summary(
            io.out, {arguments.output},
            {{"revision", config->revision}, {"bytes", slot.size()}, {"most_bytes", most_bytes}},
            remarks);
    }
    for (const auto &remark : remarks) io.err << "compbox: " << remark << "\n";
    if (cli::on_stdout({arguments.output})) return;
    io.out << fmt::format("revision {}, {} of {} bytes: {}\n", config->revision, slot.size(),
                          most_bytes, arguments.output);
}

}  // namespace

void add_pack(cli::command &app) {
    const auto arguments = std::make_shared<pack_arguments>();
    cli::command pack = app.add_subcommand("pack", "A coefficient file for the MCU's flash");
    pack.footer(
        R"(Checks the file as the box does and puts a header with revision, length and CRC-32 before it. The
box loads the newest valid revision of its two slots.

Example:
  compbox pack coefficients.json -o slot.bin)");
    pack.add_option("COEFFICIENTS", arguments->input, "Coefficient file").required();
    pack.add_option("-o,--output SLOT.bin", arguments->output, "Image of one slot, slot.bin")
        .required();
    cli::add_json(pack, arguments->as_json);
    pack.callback([arguments](const cli::streams &io) { run_pack(*arguments, io); });
}

}  // namespace compbox
