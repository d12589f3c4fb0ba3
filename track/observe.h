/*
 * What passes between the threads: blob sets from cameras, shots, marker sets.
 * All of them are flat and of fixed size, so that rings can copy them and takes can store them.
 */
#pragma once

#include <stdint.h>

#include "base/geometry.h"

#define CAMERA_MAX 32   /* a camera mask is 32 bits */
#define BLOB_MAX 1024   /* per camera and shot */
#define LABEL_MAX 768   /* markers of all actors together */
#define MARKER_MAX 1024 /* markers in a set: the labels first, then those without a name */
#define HEAD_MAX 6      /* one per actor */

enum blob_flag {
	BLOB_SATURATED = 1, /* a pixel at the top of the range */
	BLOB_MERGED = 2,    /* probably two markers, or split from such a blob */
	BLOB_EDGE = 4,      /* touches the border of the image */
};

/* One bright spot. Pixel (0,0) is the centre of the top-left pixel. */
struct blob {
	float x_px, y_px;
	float sigma_px;     /* one standard deviation of x and of y */
	float area_px2;     /* pixels above the threshold */
	uint16_t peak;      /* grey value above the background */
	uint16_t flags;     /* enum blob_flag */
	float shape_px2[3]; /* spread of its light, lens blur included: xx xy yy; 0 = not known */
};

/* The blobs of one exposure of one camera. Times are CLOCK_MONOTONIC. */
struct blob_set {
	uint64_t shot;       /* from the source, when it knows; else SHOT_UNKNOWN */
	uint64_t device_seq; /* the device's own frame counter */
	int64_t mid_exposure_ns;
	int64_t uncertainty_ns; /* bound on the error of mid_exposure_ns */
	int64_t arrival_ns;     /* when the last pixel was in memory */
	int64_t found_ns;       /* when the blobs were found */
	uint32_t blob_count;
	uint32_t blobs_lost; /* found, but past BLOB_MAX */
	struct blob blobs[BLOB_MAX];
};

#define SHOT_UNKNOWN UINT64_MAX

/* The blob sets of one instant; the sets are borrowed. */
struct shot {
	uint64_t number;
	int64_t mid_exposure_ns;                 /* mean over the cameras present */
	int64_t uncertainty_ns;                  /* largest of the cameras present */
	uint32_t camera_count;                   /* cameras of the rig */
	uint32_t missing_mask;                   /* bit c: camera c sent nothing for this shot */
	const struct blob_set *sets[CAMERA_MAX]; /* NULL where missing */
};

enum marker_status {
	MARKER_MISSING,    /* nothing known: position and covariance are meaningless */
	MARKER_PREDICTED,  /* filled in from the head and its neighbours, not seen */
	MARKER_TWO_CAMERA, /* seen by two cameras: no third view confirms it */
	MARKER_MEASURED,   /* seen by three or more */
};

#define LABEL_NONE (-1)

enum marker_flag {
	MARKER_GONE = 1,       /* a label: cameras that should see it have not for long; fell off */
	MARKER_GHOST = 2,      /* no label: stands still on the stage or on a head; no marker */
	MARKER_STABILISED = 4, /* stabilised_m is known */
	MARKER_NORMALISED = 8, /* normalised_m is known too: the day's offset was learned */
};

struct marker {
	int16_t label;  /* index into the layout, or LABEL_NONE */
	uint8_t status; /* enum marker_status */
	uint8_t camera_count;
	uint32_t camera_mask;
	uint32_t flags;        /* enum marker_flag */
	float confidence;      /* that the name is right, 0 to 1; 0 without a name or unseen */
	float residual_px;     /* rms of the reprojection; 0 when no camera sees it */
	float stabilised_m[3]; /* in the coordinates of its actor's head */
	float normalised_m[3]; /* the same as the master neutral would have it */
	struct vec3 p_stage_m;
	double cov_m2[6]; /* xx xy xz yy yz zz, stage axes */
};

struct head {
	uint8_t valid;
	uint8_t rigid_count; /* rigid markers in the fit */
	uint8_t jig_slip;    /* the rigid markers sit elsewhere on the skull than they did */
	double slip_m;       /* by how much they and the skin disagree */
	struct pose rt_stage_head;
	double residual_m; /* rms distance of the rigid markers from the fitted head */
};

/* One per shot, even if empty. markers[0 .. label_count) are the layout's, in its order; behind
 * them come the unlabelled ones. */
struct marker_set {
	uint64_t shot;
	int64_t mid_exposure_ns;
	int64_t uncertainty_ns;
	int64_t arrival_ns; /* last camera's last pixel in memory */
	int64_t found_ns;   /* last camera's blobs found */
	int64_t solved_ns;
	uint32_t rig_serial; /* of the rigs of this station: which one it was solved with */
	uint32_t run; /* of the station since it was configured; shots are numbered anew in each */
	uint32_t camera_count;
	uint32_t missing_mask;
	uint32_t label_count;
	uint32_t marker_count;
	uint32_t markers_lost;      /* unlabelled ones past MARKER_MAX */
	uint32_t is_hd;             /* the HD cameras expose in this shot; then: */
	uint32_t hd_phase;          /* shot % hd_divider */
	uint64_t hd_index;          /* shot / hd_divider: frame number of every HD camera */
	int64_t hd_mid_exposure_ns; /* of HD cameras in this shot, as planned */
	uint32_t head_count;        /* one per actor of the layout, valid or not */
	struct head heads[HEAD_MAX];
	struct marker markers[MARKER_MAX];
};
