// SPDX-License-Identifier: MIT
#include "host-tools/plc/libmodbus.h"

#include <modbus/modbus.h>
#include <netdb.h>
#include <sys/file.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace compbox::plc {

namespace {

// out: "registers 100 to 103", "coil 7"
std::string range_name(table of, int start, std::size_t count) {
    const char *one = of == table::coil       ? "coil"
                      : of == table::discrete ? "discrete input"
                      : of == table::input    ? "input register"
                                              : "register";
    if (count == 1) return fmt::format("{} {}", one, start);
    const int last = start + static_cast<int>(count) - 1;
    return fmt::format("{}s {} to {}", one, start, last);
}

// in : errno of libmodbus for an exception. out: cause and remedy; "": it is no exception
std::string exception_words(int error) {
    switch (error) {
        case EMBXILFUN:
            return "exception 1, illegal function: the server does not have this function; try "
                   "another --table";
        case EMBXILADD:
            return "exception 2, illegal address: the server has no such registers; compare "
                   "address (from 0) and count with its map";
        case EMBXILVAL:
            return "exception 3, illegal value: the server refuses the count or the value";
        case EMBXSFAIL:
            return "exception 4, server failure: look at the PLC's diagnosis";
        case EMBXACK:
            return "exception 5, acknowledge: the server needs longer; ask again";
        case EMBXSBUSY:
            return "exception 6, server busy: ask again later";
        case EMBXNACK:
            return "exception 7, negative acknowledge: the server cannot do it";
        case EMBXMEMPAR:
            return "exception 8, memory parity error: look at the PLC's diagnosis";
        case EMBXGPATH:
            return "exception 10, gateway path unavailable: check the gateway's configuration";
        case EMBXGTAR:
            return "exception 11, no reply behind the gateway: check --unit and the device's power";
        default:
            return error == EMBUNKEXC ? "an exception that Modbus does not define" : "";
    }
}

// out: cause and remedy of a failed open() or connect()
std::string connect_words(const wire &to, int error) {
    switch (error) {
        case ECONNREFUSED:
            return "connection refused: nothing listens on this port; start the PLC's Modbus "
                   "server, or check the port (usually 502)";
        case ETIMEDOUT:
        case EINPROGRESS:
            return fmt::format("no connection within {} ms: check address, cable and firewall",
                               to.timeout_ms);
        case EACCES:
        case EPERM:
            return to.is_serial() ? "no permission: add yourself to the device's group (sudo "
                                    "adduser $USER dialout) and log in again"
                                  : "no permission: a firewall rule forbids the connection";
        case ENOENT:
            return "there is no such device: ls /dev/ttyUSB* /dev/ttyACM* /dev/ttyS* lists what is "
                   "there";
        case EBUSY:
        case EWOULDBLOCK:
            return "another program has it open, such as compboxd: stop that first";
        case ENOTTY:
            return "this is no serial device";
        case EINVAL:
            return "the device does not take this baud rate or parity: try --parity none";
        default:
            return fmt::format("{}: check address, cable and network", std::strerror(error));
    }
}

// out: cause and remedy of a request without a usable reply
std::string reply_words(const wire &to, int error) {
    switch (error) {
        case ETIMEDOUT:
            return fmt::format(
                "no reply from unit {} within {} ms: check --unit, {}", to.unit, to.timeout_ms,
                to.is_serial() ? "--baud, --parity, --stop-bits and the wires A and B"
                               : "and whether the server serves one client only");
        case EPIPE:
        case ECONNRESET:
            return "the server closed the connection: does it serve another client?";
        case EMBBADCRC:
            return "a reply with a wrong check sum: check --baud, --parity, --stop-bits and the "
                   "wiring";
        case EMBBADSLAVE:
            return fmt::format(
                "a reply of another unit than {}: check --unit, and whether two "
                "masters are on the line",
                to.unit);
        case EMBBADDATA:
        case EMBBADEXC:
        case EMBMDATA:
            return "a reply that does not match the request: the peer may be no Modbus server";
        case EINTR:
            return "interrupted";
        default:
            return modbus_strerror(error);
    }
}

// out: the host's address in numbers, because libmodbus reports an unknown name as "refused"
std::string resolve(const wire &to) {
    addrinfo hints = {}, *found = nullptr;
    char numeric[NI_MAXHOST];
    hints.ai_socktype = SOCK_STREAM;
    const int error = ::getaddrinfo(to.host.c_str(), nullptr, &hints, &found);
    if (error != 0)
        throw input_error(
            fmt::format("{}: {}: write an address in numbers, or a name that this "
                        "computer resolves",
                        to.host, ::gai_strerror(error)));
    ::getnameinfo(found->ai_addr, found->ai_addrlen, numeric, sizeof numeric, nullptr, 0,
                  NI_NUMERICHOST);
    ::freeaddrinfo(found);
    return numeric;
}

modbus_t *new_context(const wire &to) {
    if (to.is_serial()) {
        const char parity = to.parity == "even" ? 'E' : to.parity == "odd" ? 'O' : 'N';
        return modbus_new_rtu(to.device.c_str(), to.baud, parity, 8, to.stop_bits);
    }
    return modbus_new_tcp_pi(resolve(to).c_str(), std::to_string(to.port).c_str());
}

}  // namespace

std::string wire::name() const {
    if (is_serial()) return device;
    const bool colons = host.find(':') != std::string::npos;
    return colons ? fmt::format("[{}]:{}", host, port) : fmt::format("{}:{}", host, port);
}

struct client::inside {
    wire to;
    modbus_t *context;

    explicit inside(const wire &wire_) : to(wire_), context(new_context(wire_)) {
        if (context == nullptr) throw input_error(to.name() + ": " + connect_words(to, errno));
    }
    ~inside() {
        modbus_close(context);
        modbus_free(context);
    }
    inside(const inside &) = delete;

    // The lock keeps two masters off a line; compboxd requests it too.
    void connect() {
        const auto seconds = static_cast<std::uint32_t>(to.timeout_ms / 1000);
        const auto us = static_cast<std::uint32_t>(to.timeout_ms % 1000 * 1000);
        modbus_set_response_timeout(context, seconds, us);
        modbus_set_byte_timeout(context, seconds, us);
        errno = 0;
        const bool good = modbus_set_slave(context, to.unit) == 0 && modbus_connect(context) == 0;
        const bool locked =
            !good || !to.is_serial() || ::flock(modbus_get_socket(context), LOCK_EX | LOCK_NB) == 0;
        if (!good || !locked)
            throw input_error(fmt::format("{}: {}", to.name(), connect_words(to, errno)));
        if (to.rs485 && modbus_rtu_set_serial_mode(context, MODBUS_RTU_RS485) != 0)
            throw input_error(
                fmt::format("{}: its driver has no RS-485 mode: leave rs485 out, or "
                            "use an adapter that switches by itself",
                            to.name()));
    }

    // in : result of a call of libmodbus, and its range
    void must_succeed(int result, const char *what, table of, int start, std::size_t count) const {
        if (result >= 0) return;
        const int error = errno;
        const std::string place = fmt::format("{}, unit {}: {} {}", to.name(), to.unit, what,
                                              range_name(of, start, count));
        const std::string exception = exception_words(error);
        if (!exception.empty()) throw refusal(place + ": " + exception);
        throw input_error(place + ": " + reply_words(to, error));
    }

    // in : count within one request
    void read_some(table from, int start, int count, std::uint16_t *words) const {
        std::uint8_t bits[MODBUS_MAX_READ_BITS];
        int result = -1;
        switch (from) {
            case table::holding:
                result = modbus_read_registers(context, start, count, words);
                break;
            case table::input:
                result = modbus_read_input_registers(context, start, count, words);
                break;
            case table::coil:
                result = modbus_read_bits(context, start, count, bits);
                break;
            case table::discrete:
                result = modbus_read_input_bits(context, start, count, bits);
                break;
        }
        must_succeed(result, "reading", from, start, static_cast<std::size_t>(count));
        if (from == table::coil || from == table::discrete) std::copy(bits, bits + count, words);
    }
};

client::client(const wire &to) : inside_(std::make_unique<inside>(to)) {
    inside_->connect();
}

client::~client() = default;

std::vector<std::uint16_t> client::read(table from, int start, int count) {
    const bool bits = from == table::coil || from == table::discrete;
    const int most = bits ? MODBUS_MAX_READ_BITS : MODBUS_MAX_READ_REGISTERS;
    std::vector<std::uint16_t> words(static_cast<std::size_t>(count));
    for (int done = 0; done < count; done += most) {
        inside_->read_some(from, start + done, std::min(most, count - done), words.data() + done);
    }
    return words;
}

void client::write(table to, int start, const std::vector<std::uint16_t> &words) {
    const int count = static_cast<int>(words.size());
    int result = 0;
    if (to == table::coil) {
        const std::vector<std::uint8_t> bits(words.begin(), words.end());
        result = modbus_write_bits(inside_->context, start, count, bits.data());
    } else {
        result = modbus_write_registers(inside_->context, start, count, words.data());
    }
    inside_->must_succeed(result, "writing", to, start, words.size());
}

}  // namespace compbox::plc
