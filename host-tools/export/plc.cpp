// SPDX-License-Identifier: MIT
#include "host-tools/export/plc.h"

#include "host-tools/formats/error.h"

namespace compbox::exports {

namespace {

using kind = fakeplc::number_format::kind;

constexpr int most_s7_registers = 32767;

// S7 keeps numbers big-endian; a register pair in another order is not one of its numbers.
std::string s7_type(const laid_register &one, const fakeplc::register_map &map) {
    if (one.format.bytes != fakeplc::number_format::order::abcd) {
        throw input_error(map.file, 0, 0,
                          "'{}' is not in the order ABCD that an S7 has; give it a type without "
                          "cdab or le, or lay the block out by hand",
                          one.name);
    }
    if (one.format.what == kind::floating) return "REAL";
    const bool integer = one.format.what == kind::signed_integer;
    if (one.format.registers == 2) return integer ? "DINT" : "DWORD";
    return integer ? "INT" : "WORD";
}

std::string line(const std::string &declaration, const std::string &comment) {
    std::string text = "    " + declaration;
    if (text.size() < 44) text.resize(44, ' ');
    return fmt::format("{} // {}\n", text, comment);
}

std::string spare(int from, int to) {
    return line(fmt::format("spare_{} : ARRAY[0..{}] OF WORD;", from, to - from - 1),
                fmt::format("register {}, byte {}", from, 2 * from));
}

// Register n is byte 2 n of the block, so the block begins with register 0.
std::string s7_block(const fakeplc::register_map &map, const std::vector<laid_register> &laid,
                     const std::string &source) {
    std::string text = fmt::format(
        "// Registers of the box in {}, by compbox export --format plc-db. Do not edit: the\n"
        "// addresses are the file's. Holding register n is byte 2 n; not optimized, big-endian.\n"
        "// Every Modbus client can write this block: keep the largest offsets out of it, as "
        "constants\n"
        "// of the PLC program.\n"
        "DATA_BLOCK \"CompBoxRegisters\"\n"
        "{{ S7_Optimized_Access := 'FALSE' }}\n"
        "  STRUCT\n",
        source);
    if (map.size() > most_s7_registers) {
        throw input_error(
            map.file, 0, 0,
            "register {} lies beyond what an S7 data block holds (64 kB, register {})",
            map.size() - 1, most_s7_registers - 1);
    }
    int next = 0;
    for (const auto &one : laid) {
        if (one.address < next) {
            throw input_error(map.file, 0, 0, "'{}' overlaps the number before it at register {}",
                              one.name, one.address);
        }
        if (one.address > next) text += spare(next, one.address);
        text += line(fmt::format("{} : {};", one.name, s7_type(one, map)),
                     fmt::format("register {}, byte {}{}{}", one.address, 2 * one.address,
                                 one.written_by_box ? ", box: " : ", PLC: ", one.meaning));
        next = one.end();
    }
    if (map.size() > next) text += spare(next, map.size());
    return text + "  END_STRUCT;\nBEGIN\nEND_DATA_BLOCK\n";
}

std::string quoted(const std::string &text) {
    return text.find(',') == std::string::npos ? text : fmt::format("\"{}\"", text);
}

std::string pmc_table(const std::vector<laid_register> &laid, int base) {
    std::string text = "register,pmc_address,bytes,type,written_by,name,meaning\n";
    for (const auto &one : laid) {
        text += fmt::format("{},D{},{},{},{},{},{}\n", one.address, base + 2 * one.address,
                            2 * one.format.registers, number_type(one.format),
                            one.written_by_box ? "box" : "PLC", one.name, quoted(one.meaning));
    }
    return text;
}

}  // namespace

output_file plc_registers(const fakeplc::register_map &map, const json &file,
                          const std::string &source, int pmc_base) {
    const auto laid = lay_out(map, least_sizes_um(file));
    if (map.profile == "fanuc") return {"pmc_addresses.csv", pmc_table(laid, pmc_base)};
    return {"compbox_registers.scl", s7_block(map, laid, source)};
}

}  // namespace compbox::exports
