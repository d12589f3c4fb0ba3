/*
 * Pictures of a calibrating station for programs on the same machine: one piece of shared memory,
 * which org.stage.Control.Pictures hands over as a file descriptor that can only be read. Each
 * camera has a few slots; its capture thread copies every picture into the oldest of them and waits
 * for nobody. A reader copies a picture out and looks whether it was overwritten meanwhile.
 */
#pragma once

#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>

#define PICTURES_MAGIC UINT32_C(0x53746750)
#define PICTURES_VERSION 1
#define PICTURES_CAMERA_MAX 32
#define PICTURES_SLOTS 4
#define PICTURES_NAME_BYTES 64
#define PICTURES_FORMAT_BYTES 16

struct picture_slot {
	_Atomic uint64_t seq; /* of the camera's pictures, from 1; 0 while it is written */
	_Atomic int64_t mid_exposure_ns;
	_Atomic uint64_t jpeg_bytes; /* of a JPEG; else 0 */
	uint64_t offset_bytes;       /* of its pixels, from the beginning: rows without padding */
};

struct picture_camera {
	char name[PICTURES_NAME_BYTES];
	uint32_t is_hd;
	char format[PICTURES_FORMAT_BYTES]; /* as in a config: grey, grey16, bayer_rg ... */
	uint32_t bits;                      /* of a grey value of 16 bits */
	uint32_t width_px, height_px;
	uint64_t size_bytes;         /* of a picture; of a JPEG, at most */
	_Atomic uint64_t newest_seq; /* in slot newest_seq % PICTURES_SLOTS; 0: none yet */
	struct picture_slot slots[PICTURES_SLOTS];
};

struct pictures {
	uint32_t magic, version;
	uint64_t size_bytes; /* all of it */
	int64_t period_ns;   /* between shots */
	uint32_t camera_count;
	struct picture_camera cameras[PICTURES_CAMERA_MAX];
};
