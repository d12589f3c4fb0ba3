/*
 * What the files of the simulated GigE Vision cameras share.
 */
#pragma once

#include <arpa/inet.h>
#include <stdatomic.h>

#include <arv.h>

#include "sim/gige/gige.h"
#include "sim/render/render.h"

struct gige_camera {
	/* set before the thread starts */
	struct gige_stage *stage;
	uint32_t index;
	char address[INET_ADDRSTRLEN];
	struct sim_renderer *renderer;
	ArvGvFakeCamera *device;
	_Atomic(ArvFakeCamera *)
		registers; /* of the device; its thread starts before this is set */

	/* owned by Aravis' thread of this camera */
	uint64_t next_shot;

	/* atomic, any thread */
	_Atomic uint64_t sent, late, skipped;
};

struct gige_stage {
	const struct sim_scene *scene;
	int64_t epoch_ns;
	int width_px, height_px;
	uint32_t camera_count;
	struct gige_abilities abilities;
	int64_t master_ahead_ns; /* of CLOCK_MONOTONIC: what cameras that follow PTP show */
	atomic_bool stopping;
	struct gige_camera cameras[CAMERA_MAX];
};

/* ArvFakeCameraFillPattern: on Aravis' thread of the camera, once per frame, before it is sent. */
void gige_expose(ArvBuffer *buffer, void *camera, guint32 exposure_us, guint32 gain,
		 ArvPixelFormat format);

/* What the camera's clock shows at `at_ns`: CLOCK_MONOTONIC, or its master's TAI. */
int64_t gige_device_ns(const struct gige_camera *camera, int64_t at_ns);

/* Aravis reads the description from a file, while the camera is made: at `path`, which ends in
 * XXXXXX. Returns 0, or a negative errno with a message. */
int gige_write_genicam(const struct gige_stage *stage, char path[], struct diag *diag);

/* Serves the camera at its address. Returns 0, or a negative errno with a message. */
int gige_start_camera(struct gige_camera *camera, const char *xml_path, struct diag *diag);
