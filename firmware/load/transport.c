/* SPDX-License-Identifier: MIT
 * The wires: plc.transport, and the section "buses". */
#include "firmware/config/config.h"
#include "firmware/config/rtu_budget.h"
#include "firmware/load/host.h"
#include "firmware/load/sections.h"

#define TCP_AT(member) .offset = offsetof(struct cb_plc_config, member)
#define SERIAL_AT(member) .offset = offsetof(struct cb_serial_config, member)
#define BUS_AT(member) .offset = offsetof(struct cb_bus_config, member)

enum { TRANSPORT_TCP, TRANSPORT_RTU, TRANSPORT_KEYS };
static const struct cb_field TRANSPORT_FIELDS[TRANSPORT_KEYS] = {
    [TRANSPORT_TCP] = {"tcp", CB_FIELD_OBJECT, false, CB_NOT_STORED},
    [TRANSPORT_RTU] = {"rtu", CB_FIELD_OBJECT, false, CB_NOT_STORED},
};
const struct cb_object cb_transport_object = {TRANSPORT_FIELDS, TRANSPORT_KEYS};

static const struct cb_word CLIENT_WORDS[] = {
    {"compbox", CB_CLIENT_COMPBOX}, {"libmodbus", CB_CLIENT_LIBMODBUS}, {0, 0}};

enum { TCP_HOST, TCP_PORT, TCP_UNIT, TCP_CLIENT, TCP_KEYS };
static const struct cb_field TCP_FIELDS[TCP_KEYS] = {
    [TCP_HOST] = {"host", CB_FIELD_TEXT, true, TCP_AT(host),
                  .size = sizeof(((struct cb_plc_config *)0)->host)},
    [TCP_PORT] = {"port", CB_FIELD_UINT16, false, TCP_AT(port), .least = "1", .most = "65535",
                  .otherwise = "502"},
    [TCP_UNIT] = {"unit", CB_FIELD_UINT8, false, TCP_AT(unit), .least = "0", .most = "255",
                  .otherwise = "1"},
    [TCP_CLIENT] = {"client", CB_FIELD_WORD, false, TCP_AT(client), .words = CLIENT_WORDS,
                    .otherwise = "compbox"},
};
const struct cb_object cb_tcp_object = {TCP_FIELDS, TCP_KEYS};

static const struct cb_word PARITY_WORDS[] = {
    {"even", CB_PARITY_EVEN}, {"odd", CB_PARITY_ODD}, {"none", CB_PARITY_NONE}, {0, 0}};

/* A bus has no unit id; each of its modules has one. */
enum {
    DEVICE,
    BAUD,
    PARITY,
    STOP_BITS,
    SLAVE_DELAY,
    RS485,
    BUS_LINE_KEYS,
    UNIT = BUS_LINE_KEYS,
    RTU_KEYS
};
#define SERIAL_FIELDS                                                                        \
    [DEVICE] = {"device", CB_FIELD_TEXT, true, SERIAL_AT(device),                            \
                .size = sizeof(((struct cb_serial_config *)0)->device)},                     \
    [BAUD] = {"baud",          CB_FIELD_UINT32, true, SERIAL_AT(line.baud),                  \
              .least = "1200", .most = "921600"},                                            \
    [PARITY] = {"parity",                                                                    \
                CB_FIELD_WORD,                                                               \
                false,                                                                       \
                SERIAL_AT(line.parity),                                                      \
                .words = PARITY_WORDS,                                                       \
                .otherwise = "even"},                                                        \
    [STOP_BITS] = {"stop_bits",  CB_FIELD_UINT8, false,           SERIAL_AT(line.stop_bits), \
                   .least = "1", .most = "2",    .otherwise = "1"},                          \
    [SLAVE_DELAY] = {"slave_delay_ms",          CB_FIELD_MS,  false,                         \
                     SERIAL_AT(slave_delay_us), .least = "0", .most = "1000"},               \
    [RS485] = {"rs485", CB_FIELD_BOOL, false, SERIAL_AT(rs485), .otherwise = "false"}
_Static_assert(CB_RTU_LEAST_BAUD == 1200 && CB_RTU_MOST_BAUD == 921600, "as in the table above");

static const struct cb_field RTU_FIELDS[RTU_KEYS] = {
    SERIAL_FIELDS,
    [UNIT] = {"unit", CB_FIELD_UINT8, false, SERIAL_AT(unit), .least = "1", .most = "247",
              .otherwise = "1"},
};
const struct cb_object cb_rtu_object = {RTU_FIELDS, RTU_KEYS};

static const struct cb_field BUS_LINE_FIELDS[BUS_LINE_KEYS] = {SERIAL_FIELDS};
const struct cb_object cb_bus_line_object = {BUS_LINE_FIELDS, BUS_LINE_KEYS};

enum { BUS_NAME, BUS_RTU, BUS_EVERY, BUS_KEYS };
static const struct cb_field BUS_FIELDS[BUS_KEYS] = {
    [BUS_NAME] = {"name", CB_FIELD_NAME, true, BUS_AT(name)},
    [BUS_RTU] = {"rtu", CB_FIELD_OBJECT, true, CB_NOT_STORED},
    [BUS_EVERY] = {"every_ms", CB_FIELD_MS, false, BUS_AT(every_us), .least = "10", .most = "60000",
                   .otherwise = "500"},
};
const struct cb_object cb_bus_object = {BUS_FIELDS, BUS_KEYS};

enum { DEFAULT_PLC_DELAY_US = 2000, DEFAULT_MODULE_DELAY_US = 50000 };

/* out: true for a path below /dev without .. */
static bool is_below_dev(const char *path) {
    static const char dev[] = "/dev/";
    const char *c = path;
    for (unsigned i = 0; dev[i]; ++i, ++c)
        if (*c != dev[i]) return false;
    if (*c == '\0') return false;
    for (--c; *c; ++c)
        if (c[0] == '/' && c[1] == '.' && c[2] == '.' && (c[3] == '/' || c[3] == '\0'))
            return false;
    return true;
}

/* in : table, cb_rtu_object or cb_bus_line_object; delay_us, the default of slave_delay_ms
 * out: *serial, with a device below /dev and a usual baud rate; or false and a message */
static bool read_serial(struct cb_loader *loader, uint32_t at, const struct cb_object *table,
                        struct cb_serial_config *serial, uint32_t delay_us) {
    uint32_t slots[RTU_KEYS];
    if (!cb_read_object(loader, at, table, serial, slots)) return false;
    if (!is_below_dev(serial->device))
        return cb_fail(loader, CB_ERROR_RANGE, slots[DEVICE],
                       "%o is not a device below /dev; write \"/dev/ttyS0\" or the like",
                       slots[DEVICE]);
    if (!cb_is_usual_baud(serial->line.baud))
        return cb_fail(
            loader, CB_ERROR_RANGE, slots[BAUD],
            "%o is not a usual baud rate: use one of 1200, 2400, 4800, 9600, 19200, 38400, "
            "57600, 115200, 230400, 460800, 921600",
            slots[BAUD]);
    if (slots[SLAVE_DELAY] == CB_ABSENT) serial->slave_delay_us = delay_us;
    return true;
}

static bool read_tcp(struct cb_loader *loader, uint32_t at) {
    struct cb_plc_config *plc = &loader->config->plc;
    uint32_t slots[TCP_KEYS];
    if (!cb_read_object(loader, at, &cb_tcp_object, plc, slots)) return false;
    if (!cb_is_numeric_address(plc->host))
        return cb_fail(loader, CB_ERROR_RANGE, slots[TCP_HOST],
                       "%o is not a numeric IPv4 or IPv6 address; names are not resolved",
                       slots[TCP_HOST]);
    if (loader->target->lacks & 1u << plc->client)
        return cb_fail(loader, CB_ERROR_PROFILE, slots[TCP_CLIENT],
                       "%s was built without %o; omit it, or install the Debian package",
                       loader->target->name, slots[TCP_CLIENT]);
    return true;
}

static bool read_rtu(struct cb_loader *loader, uint32_t at) {
    struct cb_plc_config *plc = &loader->config->plc;
    if (!read_serial(loader, at, &cb_rtu_object, &plc->serial, DEFAULT_PLC_DELAY_US)) return false;
    plc->unit = plc->serial.unit;
    return true;
}

bool cb_load_transport(struct cb_loader *loader, uint32_t at) {
    static const char *const lacking[] = {
        [CB_TRANSPORT_TCP] = "network", [CB_TRANSPORT_RTU] = "serial line"};
    uint32_t slots[TRANSPORT_KEYS];
    if (!cb_read_object(loader, at, &cb_transport_object, 0, slots)) return false;
    if ((slots[TRANSPORT_TCP] == CB_ABSENT) == (slots[TRANSPORT_RTU] == CB_ABSENT))
        return cb_fail(loader, CB_ERROR_KEY, at,
                       "exactly one of the keys tcp and rtu is needed: the wire to the PLC");
    const bool tcp = slots[TRANSPORT_TCP] != CB_ABSENT;
    const uint8_t transport = tcp ? CB_TRANSPORT_TCP : CB_TRANSPORT_RTU;
    const uint32_t wire = slots[tcp ? TRANSPORT_TCP : TRANSPORT_RTU];
    loader->config->plc.transport = transport;
    if (!(loader->target->transports & 1u << transport))
        return cb_fail(loader, CB_ERROR_PROFILE, wire, "%s has no %s", loader->target->name,
                       lacking[transport]);
    return tcp ? read_tcp(loader, wire) : read_rtu(loader, wire);
}

/* out: tenths of a millisecond, rounded up */
static uint32_t tenths(uint32_t us) {
    return (us + 99) / 100;
}

/* out: the slowest usual baud rate with which the exchange fits into budget_us; 0: none */
static uint32_t fast_enough(const struct cb_plc_config *plc, uint32_t budget_us) {
    for (const uint32_t *baud = cb_usual_bauds; *baud != 0; ++baud) {
        struct cb_rtu_line line = plc->serial.line;
        line.baud = *baud;
        if (cb_rtu_longest_us(plc, &line) <= budget_us) return *baud;
    }
    return 0;
}

/* out: true if one period has time for the exchange on the serial line, and the blocks allow probes
 *      (rtu_dialog.h); else false and a message with a baud rate that is fast enough */
bool cb_check_line(struct cb_loader *loader, uint32_t transport) {
    const struct cb_plc_config *plc = &loader->config->plc;
    if (plc->transport != CB_TRANSPORT_RTU) return true;
    if (cb_rtu_second_probe(plc) == 0)
        return cb_fail(loader, CB_ERROR_RANGE, transport,
                       "on a serial line plc.read or plc.write needs at least 4 registers, because "
                       "the box probes for late replies with shorter readings");
    const uint32_t budget_us = cb_exchange_budget_us(loader->config->period_us);
    const uint32_t needed_us = cb_rtu_longest_us(plc, &plc->serial.line);
    const uint32_t needed = tenths(needed_us), given = budget_us / 100;
    if (needed_us <= budget_us) return true;
    const uint32_t rtu = cb_find_key(loader, transport, "rtu");
    const uint32_t at = cb_find_key(loader, rtu, "baud");
    const uint32_t baud = fast_enough(plc, budget_us);
    if (baud == 0)
        return cb_fail(
            loader, CB_ERROR_RANGE, at,
            "the exchange takes %u.%u ms of %u.%u ms available, and no baud rate is fast "
            "enough: shorten the blocks or slave_delay_ms, or lengthen period_ms",
            needed / 10, needed % 10, given / 10, given % 10);
    return cb_fail(loader, CB_ERROR_RANGE, at,
                   "at %o baud the exchange takes %u.%u ms of %u.%u ms available; "
                   "%u baud is fast enough",
                   at, needed / 10, needed % 10, given / 10, given % 10, baud);
}

bool cb_load_buses(struct cb_loader *loader, uint32_t at) {
    struct cb_config *config = loader->config;
    struct cb_list list = cb_list(loader, at);
    while (cb_list_next(&list)) {
        struct cb_bus_config *bus = &config->buses[list.index];
        uint32_t slots[BUS_KEYS];
        if (list.index >= CB_MAX_BUSES)
            return cb_fail(loader, CB_ERROR_FULL, list.at,
                           "the box has room for one bus, and this is the second");
        if (!cb_read_object(loader, list.at, &cb_bus_object, bus, slots)) return false;
        if (!(loader->target->sources & 1u << CB_SOURCE_BUS))
            return cb_fail(loader, CB_ERROR_PROFILE, list.at,
                           "%s reads no sensor bus in this version", loader->target->name);
        if (!read_serial(loader, slots[BUS_RTU], &cb_bus_line_object, &bus->serial,
                         DEFAULT_MODULE_DELAY_US))
            return false;
        if (config->plc.transport == CB_TRANSPORT_RTU &&
            cb_same_text(bus->serial.device, config->plc.serial.device))
            return cb_fail(loader, CB_ERROR_RANGE, slots[BUS_RTU],
                           "the PLC uses %s; the bus needs a line of its own", bus->serial.device);
        ++config->buses_count;
    }
    return true;
}
