/* SPDX-License-Identifier: Apache-2.0 */
/* A compiled PLC program as a shared library, for conveyor_sim (docs/structured_text.md, A compiled program).
 *
 * A program that any compiler of Structured Text has made is put behind these seven functions by a shim. It is loaded
 * into a process of its own, is called by one thread, and sees simulated time only. Values are doubles: a BOOL is 0 or
 * 1. Two instances share neither time nor state: each is in a process of its own.
 */
#ifndef CONVEYOR_SIM_PLC_H
#define CONVEYOR_SIM_PLC_H

#include <stdint.h>

#define PLC_VERSION 1

enum { PLC_INPUT = 0, PLC_OUTPUT = 1 };

typedef struct plc plc; /* one instance; what is in it is the shim's */

/* PLC_VERSION, as the library was built. */
int32_t plc_version(void);

/* A cold start. NULL if there is no memory. */
plc *plc_create(void);

/* Ties a variable, by the name that it has in the program, to a place that stays valid until plc_destroy: an input is
 * read from there at the start of each scan, an output written there at its end. 0; else there is no such variable. */
int32_t plc_bind(plc *instance, const char *variable, int32_t direction, double *place);

/* One scan, at a time in ns that never goes back. 0; else the program has stopped, for a reason of the shim's. */
int32_t plc_scan(plc *instance, int64_t time_ns);

/* Bytes of the state, all that changes but the places; they are written if the size is enough for them. */
int64_t plc_snapshot(const plc *instance, void *state, int64_t size);

/* Goes on from such bytes of the same library. 0; else they are none. */
int32_t plc_restore(plc *instance, const void *state, int64_t size);

/* The end of the instance, and soon of its process: it has a second. Not called after the watchdog has ended it. */
void plc_destroy(plc *instance);

#endif
