/* SPDX-License-Identifier: MIT
 * A PLC served by libmodbus, the reference codec in C: a second peer that shares no code with the
 * box. usage: libmodbus_plc PORT, or libmodbus_plc DEVICE for RTU at 115 200 baud, unit 1, with
 * "address value" lines on stdin for the first registers. Register 1 counts up with each request.
 * Each written block 100 … 115 becomes a line on stdout. */
#include <errno.h>
#include <modbus/modbus.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

static void print_block(const modbus_mapping_t *memory) {
    for (int i = 100; i < 116; i++) printf("%d ", memory->tab_registers[i]);
    printf("\n");
    fflush(stdout);
}

static void serve(modbus_t *server, modbus_mapping_t *memory) {
    uint8_t request[MODBUS_TCP_MAX_ADU_LENGTH];
    for (int length; (length = modbus_receive(server, request)) >= 0;) {
        if (length == 0) continue; /* RTU: for another unit */
        memory->tab_registers[1]++;
        modbus_reply(server, request, length, memory);
        int function = request[modbus_get_header_length(server)];
        if (function == 16 || function == 23) print_block(memory);
    }
}

static modbus_t *open_server(const char *where, bool serial) {
    modbus_t *server = serial ? modbus_new_rtu(where, 115200, 'N', 8, 1)
                              : modbus_new_tcp("127.0.0.1", atoi(where));
    if (server != NULL && serial) modbus_set_slave(server, 1);
    return server;
}

static void say_listening(void) {
    printf("listening\n");
    fflush(stdout);
}

static int serve_tcp(modbus_t *server, modbus_mapping_t *memory) {
    int listening = modbus_tcp_listen(server, 1);
    if (listening < 0) return 1;
    say_listening();
    while (modbus_tcp_accept(server, &listening) >= 0) {
        serve(server, memory);
        modbus_close(server);
    }
    return 1;
}

static int serve_rtu(modbus_t *server, modbus_mapping_t *memory) {
    if (modbus_connect(server) != 0) return 1;
    say_listening();
    for (;;) { /* a frame with an error ends modbus_receive, not the server */
        serve(server, memory);
        if (errno == EIO) return 1;
    }
}

int main(int argc, char **argv) {
    const bool serial = argc == 2 && argv[1][0] == '/';
    modbus_t *server = argc == 2 ? open_server(argv[1], serial) : NULL;
    modbus_mapping_t *memory = modbus_mapping_new(0, 0, 200, 0);
    if (server == NULL || memory == NULL) return 2;
    for (unsigned address, value; scanf("%u %u", &address, &value) == 2 && address < 200;)
        memory->tab_registers[address] = (uint16_t)value;
    return serial ? serve_rtu(server, memory) : serve_tcp(server, memory);
}
