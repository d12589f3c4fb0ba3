/*
 * The world as its own drivers see it.
 */
#pragma once

#include <stdbool.h>

#include "sim/faults.h"
#include "sim/world/world.h"

/* How long after mid-exposure a shot's last pixel is in memory. */
#define SIM_HALF_EXPOSURE_NS (250 * NS_PER_US)
#define SIM_HD_HALF_EXPOSURE_NS (2 * NS_PER_MS)
#define SIM_READOUT_NS (1000 * NS_PER_US)

/* What its cameras do wrong. Any thread; a world must be open. */
const struct sim_faults *sim_world_faults(void);

/* Of what the world shows: another one, another scene. Control thread. */
uint64_t sim_world_serial(void);

/* Any thread. */
void sim_world_count_late(uint32_t camera);

/* Whether the trigger fires them; true while nobody says otherwise. Any thread. */
bool sim_world_strobes_lit(void);
void sim_world_light_strobes(bool lit);

/* When shot's mid-exposure is on CLOCK_MONOTONIC. A world must be open. */
int64_t sim_world_mid_exposure_ns(uint64_t shot);

/* The first shot whose mid-exposure is not before `time_ns`. */
uint64_t sim_world_shot_after(int64_t time_ns);
