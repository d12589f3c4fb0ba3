/*
 * What doctor knows of this machine and the config that no file below root tells.
 */
#pragma once

#include "config/stage.h"
#include "ctl/doctor/doctor.h"

/* Who asks, limits, clock. Does not touch the disk. */
void doctor_gather(struct doctor_facts *facts);

/* Writes up to 64 MB or half a second's worth past the page cache into facts->recordings_dir, and
 * takes it away again; measures speed and space. */
void doctor_probe_disk(struct doctor_facts *facts);

/* What each camera sends, by the config, and of IR cameras by the rig. */
void doctor_find_loads(struct doctor_load loads[CAMERA_MAX], const struct stage *stage);
