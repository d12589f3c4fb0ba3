/*
 * What the floor sends: FLOOR_MESSAGE_BYTES (a marker set of 74 markers), the first eight of which
 * are the time at which the frames were in memory.
 */
#pragma once

#define FLOOR_MESSAGE_BYTES 5200
