/* SPDX-License-Identifier: MIT
 * Whether the text of plc.host is an address: without a resolver, which could block. */
#ifndef COMPBOX_FIRMWARE_LOAD_HOST_H
#define COMPBOX_FIRMWARE_LOAD_HOST_H

#include <stdbool.h>

/* out: true if `text` is a numeric address as inet_pton accepts it: IPv4 (127.0.0.1) or IPv6
 *      (fe80::1, ::ffff:10.0.0.1); no name, no port, no zone, no leading zeros in IPv4 */
bool cb_is_numeric_address(const char *text);

#endif
