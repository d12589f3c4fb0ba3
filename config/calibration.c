/*
 * The keys of a calibration, their limits and defaults.
 */
#include "config/calibration.h"

#include <errno.h>
#include <stddef.h>

#include "base/clock.h"
#include "config/yaml.h"

#define FILE_SIZE_MAX (1 << 16)

#define BOARD_AT(member) offsetof(struct board, member)
#define BOARD_NUMBER(what, member, low, high, words) \
	.kind = (what), .offset = BOARD_AT(member), .min = (low), .max = (high), .unit = (words)

static const struct yaml_key board_keys[] = {
	{"squares_x",
	 BOARD_NUMBER(YAML_INT, squares_x, BOARD_SQUARES_MIN, BOARD_SQUARES_MAX, "squares"),
	 .required = true},
	{"squares_y",
	 BOARD_NUMBER(YAML_INT, squares_y, BOARD_SQUARES_MIN, BOARD_SQUARES_MAX, "squares"),
	 .required = true},
	{"square_m", BOARD_NUMBER(YAML_DOUBLE, square_m, 0.001, 1, "metres"), .required = true},
	{"tag_part", BOARD_NUMBER(YAML_DOUBLE, tag_part, 0.1, 1, "parts of a square")},
	{"first_id", BOARD_NUMBER(YAML_INT, first_id, 0, BOARD_TAG_COUNT - 1, NULL)},
	{0},
};

#define LIMIT(member, high, words)                                                               \
	.kind = YAML_DOUBLE, .offset = offsetof(struct calibration_limits, member), .min = 1e-4, \
	.max = (high), .unit = (words)

static const struct yaml_key limit_keys[] = {
	{"rms_px", LIMIT(rms_px, 100, "pixels")},
	{"held_out_px", LIMIT(held_out_px, 100, "pixels")},
	{"uncertainty_mm", LIMIT(uncertainty_mm, 1000, "millimetres")},
	{"worst_mm", LIMIT(worst_mm, 1000, "millimetres")},
	{0},
};

static void read_board_keys(struct yaml *yaml, const struct yaml_value *value, struct board *board)
{
	*board = BOARD_DEFAULT;
	yaml_read_mapping(yaml, value, board_keys, board, NULL);
	if (!yaml->failed && board_check(board, yaml->path, yaml->diag) < 0)
		yaml->failed = true;
}

static void read_board(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	struct calibration *calibration = target;

	read_board_keys(yaml, value, &calibration->board);
	calibration->has_board = true;
}

static void read_limits(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	yaml_read_mapping(yaml, value, limit_keys, &((struct calibration *)target)->limits, NULL);
}

static const struct yaml_key keys[] = {
	{"board", YAML_CUSTOM, .read = read_board},
	{"limits", YAML_CUSTOM, .read = read_limits},
	{"blur_max_px", YAML_DOUBLE, offsetof(struct calibration, blur_max_px), .min = 0.3,
	 .max = 20, .unit = "pixels"},
	{"poses_max", YAML_INT, offsetof(struct calibration, poses_max), .min = 8, .max = 1000,
	 .unit = "poses"},
	{"poses_min", YAML_INT, offsetof(struct calibration, poses_min), .min = 8, .max = 1000,
	 .unit = "poses"},
	{"rate_hz", YAML_DOUBLE, offsetof(struct calibration, rate_hz), .min = 1, .max = 120,
	 .unit = "hertz"},
	{"exposure_us", YAML_MICROS, offsetof(struct calibration, exposure_ns), .min = 1,
	 .max = 1e6, .unit = "microseconds"},
	{"hd_exposure_us", YAML_MICROS, offsetof(struct calibration, hd_exposure_ns), .min = 1,
	 .max = 1e6, .unit = "microseconds"},
	{0},
};

struct calibration calibration_default(void)
{
	return (struct calibration){.board = BOARD_DEFAULT,
				    .limits = {.rms_px = 0.5,
					       .held_out_px = 0.6,
					       .uncertainty_mm = 0.3,
					       .worst_mm = 1.0},
				    .blur_max_px = 2,
				    .poses_max = 100,
				    .poses_min = 40,
				    .rate_hz = 12,
				    .exposure_ns = 2 * NS_PER_MS};
}

void calibration_read(struct yaml *yaml, const struct yaml_value *value,
		      struct calibration *calibration)
{
	yaml_read_mapping(yaml, value, keys, calibration, NULL);
}

int board_load(struct board *board, const char *path, struct diag *diag)
{
	struct yaml_value root;
	struct board made;
	struct yaml yaml;
	int err = yaml_open(&yaml, path, FILE_SIZE_MAX, diag);

	if (err)
		return err;
	root = yaml_root(&yaml);
	read_board_keys(&yaml, &root, &made);
	err = yaml.failed ? -EINVAL : 0;
	yaml_close(&yaml);
	if (!err)
		*board = made;
	return err;
}

void board_print(FILE *file, const struct board *board)
{
	fprintf(file, "squares_x: %d\nsquares_y: %d\n", board->squares_x, board->squares_y);
	fprintf(file, "square_m: %.9g\ntag_part: %.9g\n", board->square_m, board->tag_part);
	fprintf(file, "first_id: %d\n", board->first_id);
}
