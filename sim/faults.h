/*
 * What simulated cameras do wrong, and when: faults as data, so that a test or an operator can have
 * each of them at a known moment.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "config/sim_faults.h"

/* Faults of one frame: bit k is enum sim_fault_kind k. */
typedef uint32_t sim_fault_mask;

#define SIM_FAULT_BIT(kind) (UINT32_C(1) << (kind))

/* Of the frame of a camera that is exposed at `time_ns` of the scene; `period_ns` between its
 * frames. Any thread. */
sim_fault_mask sim_faults_of(const struct sim_faults *faults, const char *device, int64_t time_ns,
			     int64_t period_ns);

/* How far the camera's clock is off at that time; 0 without SIM_FAULT_CLOCK_STEP. */
int64_t sim_faults_clock_off_ns(const struct sim_faults *faults, const char *device,
				int64_t time_ns);

/* The delay of SIM_FAULT_DELAY at that time; 0 without. */
int64_t sim_faults_delay_ns(const struct sim_faults *faults, const char *device, int64_t time_ns);

/* Whether the camera was unplugged at some time before, so that it counts anew. */
bool sim_faults_was_unplugged(const struct sim_faults *faults, const char *device, int64_t time_ns);
