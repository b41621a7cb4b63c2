// SPDX-License-Identifier: Apache-2.0
/* table.st as a compiler leaves it, in the manner of MATIEC, and the shim that makes a library of it:
 *
 *     cc -shared -fPIC -O2 -I include -o table.so examples/st/compiled/table.c
 */
#include <stdlib.h>
#include <string.h>

#include "conveyor_sim_plc.h"

/* ---- what the compiler made ---- */

typedef struct {
    int64_t since; /* ns; -1: not timing */
    int8_t Q;
} TON;

typedef struct {
    int8_t EYE;
    double FEEDER_SPEED;
    double TABLE_SPEED;
    int8_t HELD;
    TON FREE;
} TABLE;

static int64_t current_time; /* ns; one instance lives in one process */

static void TON_body(TON *timer, int in, int64_t pt) {
    if (!in) {
        timer->since = -1;
    } else if (timer->since < 0) {
        timer->since = current_time;
    }
    timer->Q = in && current_time - timer->since >= pt;
}

static void TABLE_init(TABLE *data) {
    memset(data, 0, sizeof *data);
    data->FREE.since = -1;
}

static void TABLE_body(TABLE *data) {
    TON_body(&data->FREE, !data->EYE, INT64_C(5000000000));
    data->HELD = data->EYE || (data->HELD && !data->FREE.Q);
    data->FEEDER_SPEED = data->HELD ? 0.0 : 0.4;
    data->TABLE_SPEED = 0.4;
}

/* ---- the shim ---- */

struct plc {
    TABLE program;
    double *eye, *feeder_speed, *table_speed, *held;
};

int32_t plc_version(void) { return PLC_VERSION; }

plc *plc_create(void) {
    plc *instance = calloc(1, sizeof *instance);
    if (instance) TABLE_init(&instance->program);
    return instance;
}

int32_t plc_bind(plc *p, const char *variable, int32_t direction, double *place) {
    struct { const char *name; int32_t direction; double **place; } all[] = {
        {"eye", PLC_INPUT, &p->eye},
        {"feeder_speed", PLC_OUTPUT, &p->feeder_speed},
        {"table_speed", PLC_OUTPUT, &p->table_speed},
        {"held", PLC_OUTPUT, &p->held},
    };
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        if (strcmp(variable, all[i].name) == 0 && direction == all[i].direction) {
            *all[i].place = place;
            return 0;
        }
    }
    return 1;
}

int32_t plc_scan(plc *p, int64_t time_ns) {
    current_time = time_ns;
    if (p->eye) p->program.EYE = *p->eye >= 0.5;
    TABLE_body(&p->program);
    if (p->feeder_speed) *p->feeder_speed = p->program.FEEDER_SPEED;
    if (p->table_speed) *p->table_speed = p->program.TABLE_SPEED;
    if (p->held) *p->held = p->program.HELD;
    return 0;
}

int64_t plc_snapshot(const plc *p, void *state, int64_t size) {
    if (size >= (int64_t)sizeof p->program) memcpy(state, &p->program, sizeof p->program);
    return sizeof p->program;
}

int32_t plc_restore(plc *p, const void *state, int64_t size) {
    if (size != (int64_t)sizeof p->program) return 1;
    memcpy(&p->program, state, sizeof p->program);
    return 0;
}

void plc_destroy(plc *p) { free(p); }
