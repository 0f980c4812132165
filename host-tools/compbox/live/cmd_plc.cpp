// SPDX-License-Identifier: MIT
// compbox plc: reads, writes and watches registers with libmodbus, not with the box's own client.
#include <charconv>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "host-tools/command_line/option_checks.h"
#include "host-tools/command_line/summary.h"
#include "host-tools/compbox/live/commands.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/json.h"
#include "host-tools/plc/machine.h"
#include "host-tools/plc/watch.h"

namespace compbox::live {

namespace {

constexpr int address_space = 65536;
constexpr int registers_at_once = 123, bits_at_once = 1968;  // of one request that writes

enum class deed { read, write, watch };

struct plc_options {
    deed what = deed::read;
    std::string plc, config, type = "uint16", parity;
    std::vector<std::string> words;
    plc::table table = plc::table::holding;
    std::optional<unsigned> unit, baud, stop_bits;
    double scale = 1.0;
    int timeout_ms = 1000;
    std::optional<unsigned> every_ms, count;
    bool rs485 = false, no_read_back = false, as_json = false;
};

bool is_bits(plc::table table) {
    return table == plc::table::coil || table == plc::table::discrete;
}

std::optional<int> whole_in(const std::string &text) {
    const bool hex = text.rfind("0x", 0) == 0;
    int value = 0;
    const char *end = text.data() + text.size();
    const auto result = std::from_chars(text.data() + (hex ? 2 : 0), end, value, hex ? 16 : 10);
    if (result.ec != std::errc() || result.ptr != end) return std::nullopt;
    return value;
}

// The server, and what of it the command line names.
class plc_command {
  public:
    plc_command(const plc_options &options, const cli::streams &io) : options_(options), io_(io) {
        check_usage();
        const bool file = plc::is_file(options.plc);
        if (file || !options.config.empty()) machine_.emplace(file ? options.plc : options.config);
        to_ = file ? machine_->to_plc() : plc::parse_wire(options.plc);
        complete_wire();
    }

    void run() {
        switch (options_.what) {
            case deed::read:
                return read();
            case deed::write:
                return write();
            case deed::watch:
                return watch();
        }
    }

  private:
    // Throws usage_error for options that have no effect together.
    void check_usage() const {
        const bool writes = options_.what == deed::write, watches = options_.what == deed::watch;
        if (!watches && (options_.every_ms || options_.count))
            throw cli::usage_error("--every-ms and --count belong to compbox plc watch");
        if (!writes && options_.no_read_back)
            throw cli::usage_error("--no-read-back belongs to compbox plc write");
        if (is_bits(options_.table) && (options_.type != "uint16" || options_.scale != 1.0))
            throw cli::usage_error("--table", "coils and discrete inputs have no type and scale");
        if (writes && options_.table != plc::table::holding && options_.table != plc::table::coil)
            throw cli::usage_error("--table", "only holding registers and coils can be written");
        if (writes && options_.words.size() < 2)
            throw cli::usage_error(
                "write needs an address or name and the values, as in compbox plc write "
                "192.168.0.10:502 104 250");
        if (plc::is_file(options_.plc) && !options_.config.empty())
            throw cli::usage_error("--config", "the first argument is a file already");
    }

    // The options of the line override those of the file.
    void complete_wire() {
        to_.timeout_ms = options_.timeout_ms;
        if (options_.unit) to_.unit = static_cast<int>(*options_.unit);
        const bool of_line =
            options_.baud || options_.stop_bits || !options_.parity.empty() || options_.rs485;
        if (!to_.is_serial() && of_line)
            throw cli::usage_error(
                "--baud, --parity, --stop-bits and --rs485 belong to a serial device");
        if (options_.baud) to_.baud = static_cast<int>(*options_.baud);
        if (options_.stop_bits) to_.stop_bits = static_cast<int>(*options_.stop_bits);
        if (!options_.parity.empty()) to_.parity = options_.parity;
        to_.rs485 = to_.rs485 || options_.rs485;
    }

    // An item by --table, --type and --scale at the address.
    plc::item plain_item(int address) const {
        plc::item made;
        made.from = options_.table;
        made.address = address;
        made.format = *fakeplc::number_format::parse(options_.type);
        made.scale = options_.scale;
        if (made.end() > address_space)
            throw cli::usage_error(fmt::format("address {} is beyond 65535", made.end() - 1));
        return made;
    }

    // in : the word behind the server. out: its item; an address begins with a digit
    plc::item item_of(const std::string &word) const {
        const auto address = whole_in(word);
        if (address && *address >= 0) return plain_item(*address);
        if (machine_) return machine_->named(word);
        throw cli::usage_error(fmt::format(
            "'{}' is no address from 0 to 65535; names need --config with a machine file", word));
    }

    // out: what read and watch show: ADDRESS [COUNT], names, or all registers of the file
    std::vector<plc::item> chosen() const {
        const auto &words = options_.words;
        if (words.empty() && machine_) return machine_->items();
        if (words.empty())
            throw cli::usage_error(
                "an address is missing, as in compbox plc read 192.168.0.10:502 100 4");
        std::vector<plc::item> items = {item_of(words[0])};
        const auto count = words.size() == 2 ? whole_in(words[1]) : std::nullopt;
        if (!items[0].name.empty() || (words.size() > 1 && machine_ && !count)) {
            for (std::size_t i = 1; i < words.size(); ++i) items.push_back(item_of(words[i]));
            return items;
        }
        if (words.size() > 2 || (words.size() == 2 && (!count || *count < 1)))
            throw cli::usage_error("behind the address comes one COUNT, a number of values");
        for (int i = 1; i < count.value_or(1); ++i) items.push_back(plain_item(items.back().end()));
        return items;
    }

    json head() const { return {{"plc", to_.name()}, {"unit", to_.unit}}; }

    void read() {
        const auto items = chosen();
        plc::client client(to_);
        const auto words = plc::read_items(client, items);
        if (!options_.as_json) return plc::print_items(io_.out, items, words);
        json figures = head();
        for (const auto &one : items) figures["values"].push_back(plc::item_figures(one, words));
        cli::print_summary(io_.out, {}, figures);
    }

    // Throws usage_error for a named register that the PLC's program writes.
    static void must_be_of_box(const plc::item &one) {
        if (!one.by_plc) return;
        throw cli::usage_error(fmt::format(
            "{} is a register that the PLC writes; the box writes value_CHANNEL, status and "
            "box_heartbeat (to test the PLC give the address {})",
            one.name, one.address));
    }

    // out: one item for each value, and its words behind those of the others
    std::vector<plc::item> values_to_write(std::vector<std::uint16_t> &words) const {
        std::vector<plc::item> items;
        for (std::size_t i = 1; i < options_.words.size(); ++i) {
            items.push_back(i == 1 ? item_of(options_.words[0]) : plain_item(items.back().end()));
            if (i > 1 && !items[0].name.empty())
                throw cli::usage_error(fmt::format("{} takes one value", items[0].name));
            must_be_of_box(items.back());
            const auto encoded = plc::encode(items.back(), options_.words[i]);
            words.insert(words.end(), encoded.begin(), encoded.end());
        }
        const int most = is_bits(options_.table) ? bits_at_once : registers_at_once;
        if (static_cast<int>(words.size()) > most)
            throw cli::usage_error(fmt::format("one request writes at most {} {}", most,
                                               is_bits(options_.table) ? "coils" : "registers"));
        return items;
    }

    // Writes the values in one request and reads them back. Throws input_error for a value that
    // does not fit, and for registers that hold another one behind it.
    void write() {
        std::vector<std::uint16_t> words;
        const auto items = values_to_write(words);
        plc::client client(to_);
        client.write(items[0].from, items[0].address, words);
        plc::words_at written;
        for (const std::uint16_t word : words)
            written[items[0].address + static_cast<int>(written.size())] = word;
        const std::string remark = options_.no_read_back ? "" : read_back(client, items, written);
        if (options_.as_json) {
            json figures = head();
            for (const auto &one : items)
                figures["written"].push_back(plc::item_figures(one, written));
            figures["read_back"] = options_.no_read_back ? "no"
                                   : remark.empty()      ? "equal"
                                                         : "refused";
            return cli::print_summary(
                io_.out, {}, figures,
                remark.empty() ? std::vector<std::string>() : std::vector{remark});
        }
        plc::print_items(io_.out, items, written);
        io_.out << (options_.no_read_back ? "written" : "written and read back") << "\n";
        if (!remark.empty()) io_.out << "Remark: " << remark << "\n";
    }

    // out: a remark if the server refuses the read-back. Throws input_error for other values.
    std::string read_back(plc::client &client, const std::vector<plc::item> &items,
                          const plc::words_at &written) const {
        plc::words_at found;
        try {
            found = plc::read_items(client, items);
        } catch (const plc::refusal &error) {
            return error.what() + std::string("; the write itself was confirmed");
        }
        for (const auto &one : items) {
            if (plc::words_of(one, found) == plc::words_of(one, written)) continue;
            throw input_error(fmt::format(
                "{}: register {} has {} ({}) after {} ({}) was written and confirmed: the PLC "
                "program overwrites it, or maps it elsewhere",
                to_.name(), one.place(), plc::value_text(one, found), plc::raw_text(one, found),
                plc::value_text(one, written), plc::raw_text(one, written)));
        }
        return "";
    }

    void watch() {
        plc::watch_options how;
        how.every_ms = static_cast<int>(options_.every_ms.value_or(200));
        how.count = static_cast<int>(options_.count.value_or(0));
        how.as_json = options_.as_json;
        if (!plc::watch(to_, chosen(), how, io_.out, io_.err))
            throw input_error(to_.name() + ": the last reading failed");
    }

    const plc_options &options_;
    const cli::streams &io_;
    std::optional<plc::machine> machine_;
    plc::wire to_;
};

// The options of the wire, which read, write and watch share.
void add_wire_options(cli::command &command, plc_options &options) {
    command.add_option("--unit N", options.unit, "Unit id, 0 to 255 (default 1)")
        .check(cli::whole_between(0, 255));
    command.add_option("--timeout-ms T", options.timeout_ms, "Time for a reply, 10 to 60000")
        .capture_default_str()
        .check(cli::whole_between(10, 60000));
    command.add_option("--baud B", options.baud, "Of a serial device (default 19200)")
        .check(cli::one_of({"1200", "2400", "4800", "9600", "19200", "38400", "57600", "115200",
                            "230400", "460800", "921600"}));
    command.add_option("--parity P", options.parity, "even, odd or none (default even)")
        .check(cli::one_of({"even", "odd", "none"}));
    command.add_option("--stop-bits N", options.stop_bits, "1 or 2 (default 1)")
        .check(cli::whole_between(1, 2));
    command.add_flag("--rs485", options.rs485, "The driver switches an RS-485 transmitter");
}

}  // namespace

void add_plc(cli::command &app) {
    auto command = app.add_subcommand("plc", "Read, write, watch registers of a PLC, by libmodbus");
    const auto options = std::make_shared<plc_options>();
    command
        .add_choice("ACTION", options->what,
                    std::map<std::string, deed>{
                        {"read", deed::read}, {"write", deed::write}, {"watch", deed::watch}},
                    "read, write or watch")
        .required();
    command
        .add_option("PLC", options->plc,
                    "HOST:PORT, serial device, or a machine or coefficient file")
        .required();
    command.add_option(
        "WORDS", options->words,
        "ADDRESS [COUNT] to read or watch, ADDRESS VALUE… to write; NAME… of a file");
    command.add_option("--config F.json", options->config,
                       "Names, types and scales of this file, at another PLC");
    command.add_choice("--table T", options->table,
                       std::map<std::string, plc::table>{{"holding", plc::table::holding},
                                                         {"input", plc::table::input},
                                                         {"coil", plc::table::coil},
                                                         {"discrete", plc::table::discrete}},
                       "holding (default), input, coil, discrete");
    command
        .add_option("--type T", options->type,
                    "As in a coefficient file: int16, uint32, float32, float32cdab, int32le …")
        .capture_default_str()
        .check([](const std::string &text) {
            return fakeplc::number_format::parse(text)
                       ? std::string()
                       : "must be int16, uint16, int32, uint32 or float32, perhaps with cdab or "
                         "le behind it, not " +
                             text;
        });
    command.add_option("--scale S", options->scale, "Value of one raw unit")
        .capture_default_str()
        .check([](const std::string &text) {
            const std::string fault = cli::any_number()(text);
            return fault.empty() && std::stod(text) == 0.0 ? "must not be 0" : fault;
        });
    add_wire_options(command, *options);
    command.add_option("--every-ms T", options->every_ms, "Interval of watch (default 200)")
        .check(cli::whole_between(1, 3600000));
    command.add_option("--count N", options->count, "Readings of watch (default: until Ctrl-C)")
        .check(cli::whole_between(1, 1000000000));
    command.add_flag("--no-read-back", options->no_read_back, "Write without reading back");
    cli::add_json(command, options->as_json);
    command.footer(R"(Addresses count from 0, as in the coefficient file.

Example:
  compbox plc read 192.168.0.10:502 8 3 --type int32 --scale 0.0001
  compbox plc read machine.json
  compbox plc watch machine.json X control
  compbox plc write /dev/ttyUSB0 104 250 --baud 115200)");
    command.callback([options](const cli::streams &io) { plc_command(*options, io).run(); });
}

}  // namespace compbox::live
