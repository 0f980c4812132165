/* SPDX-License-Identifier: MIT */
#include "hal/stm32f405/app/load.h"

#include "firmware/box/ceiling.h"
#include "firmware/config/config.h"
#include "hal/stm32f405/mcu.h"

static const struct cb_target target = {.name = "compbox-stm32f405",
                                        .sources = 1u << CB_SOURCE_PLC | 1u << CB_SOURCE_BUS,
                                        .transports = 1u << CB_TRANSPORT_RTU};

static const void *const slots[CB_SLOTS] = {CB_FLASH_SLOT_A, CB_FLASH_SLOT_B};

/* Fixed by the build of the image: CMakeLists.txt. */
static const struct cb_ceiling ceiling = {.um = CB_MOST_UM, .um_per_s = CB_MOST_UM_PER_S};

/* The slots as the start found them. Reading two full ones takes 26 ms at 168 MHz. */
static enum cb_slot_state states[CB_SLOTS];
static struct cb_slot found[CB_SLOTS];

static struct cb_text *begin(struct cb_console *console, int index) {
    struct cb_text *line = cb_console_line(console);
    cb_text_put(line, index == 0 ? "slot A: " : "slot B: ");
    return line;
}

/* in : index 0 or 1
 * out: one line on the console about the content of the slot */
static void report(struct cb_console *console, int index) {
    const struct cb_slot *slot = &found[index];
    struct cb_text *line = begin(console, index);
    switch (states[index]) {
        case CB_SLOT_EMPTY:
            cb_text_put(line, "empty");
            break;
        case CB_SLOT_BROKEN:
            cb_text_put(line, "BROKEN, not used: its header or its check sum is wrong");
            break;
        case CB_SLOT_WHOLE:
            cb_text_put(line, "revision ");
            cb_text_put_unsigned(line, slot->revision);
            cb_text_put(line, ", ");
            cb_text_put_unsigned(line, slot->length);
            cb_text_put(line, " bytes, CRC-32 ");
            cb_text_put_hex(line, slot->crc, 8);
            break;
    }
    cb_console_end(console);
}

static void report_refused(struct cb_console *console, int index,
                           const struct cb_message *message) {
    struct cb_text *line = begin(console, index);
    cb_text_put(line, "REFUSED, not used: ");
    cb_text_put(line, message->text);
    cb_text_put(line, ", line ");
    cb_text_put_unsigned(line, message->line);
    cb_text_put(line, ", column ");
    cb_text_put_unsigned(line, message->column);
    cb_console_end(console);
}

/* Names the channels whose limits the ceiling lowers: bit i of `lowered` is channel i. */
static void report_lowered(struct cb_console *console, const struct cb_config *config,
                           uint32_t lowered) {
    if (lowered == 0) return;
    struct cb_text *line = cb_console_line(console);
    cb_text_put(line, "the site's ceiling lowers the limits of");
    for (unsigned i = 0; i < cb_all_channels(config); ++i) {
        if (!(lowered & 1u << i)) continue;
        cb_text_put(line, config->channels[i].is_slope ? " the slope of " : " ");
        cb_text_put(line, config->channels[i].name);
    }
    cb_console_end(console);
}

/* out: whether the loader accepted the text of this slot; then *crc is the text's */
static bool try_slot(struct cb_config *config, struct cb_load_scratch *scratch,
                     struct cb_console *console, int index, const struct cb_slot *slot,
                     uint32_t *crc) {
    struct cb_message message = {.line = 0};
    if (cb_config_load(config, slot->text, slot->length, &target, scratch, &message) != CB_OK) {
        report_refused(console, index, &message);
        return false;
    }
    *crc = slot->crc;
    report_lowered(console, config, cb_ceiling_apply(config, &ceiling));
    return true;
}

void cb_load_read(void) {
    for (int i = 0; i < CB_SLOTS; ++i)
        states[i] = cb_slot_read(slots[i], CB_FLASH_SLOT_BYTES, &found[i]);
}

void cb_load_report(struct cb_console *console) {
    for (int i = 0; i < CB_SLOTS; ++i) report(console, i);
    cb_console_say(console,
                   "site's ceiling: size " CB_MOST_UM_WORDS ", rate " CB_MOST_UM_PER_S_WORDS);
}

char cb_load_slots(struct cb_config *config, struct cb_load_scratch *scratch,
                   struct cb_console *console, uint32_t *crc) {
    static const char names[CB_SLOTS] = {'A', 'B'};
    cb_load_report(console);
    const int first = cb_slot_newest(states, found);
    if (first < 0) return 0;
    const int other = 1 - first;
    if (try_slot(config, scratch, console, first, &found[first], crc)) return names[first];
    if (states[other] == CB_SLOT_WHOLE &&
        try_slot(config, scratch, console, other, &found[other], crc))
        return names[other];
    return 0;
}

/* The place is that of the newest file, because another revision may have moved it. */
bool cb_load_report_place(struct cb_slot_report *report) {
    const int first = cb_slot_newest(states, found) == 1;
    for (int i = 0; i < CB_SLOTS; ++i)
        if (cb_slot_read_report(slots[i ^ first], CB_FLASH_SLOT_BYTES, report)) return true;
    return false;
}
