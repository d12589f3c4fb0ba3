/*
 * Keeps the observations, runs the tool, reads its models.
 */
#include "calibration_tool.h"

#include <errno.h>
#include <limits.h>
#include <mrcal/mrcal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "calib/board/observations_file.h"
#include "calib/rt.h"

#define PYTHON "/usr/bin/python3"
#define TOOL "/usr/bin/mrcal-calibrate-cameras"
#define FOCAL_PX 1600.0

static int write_corners(const char *dir, const struct observations *o)
{
	char path[PATH_MAX];

	snprintf(path, sizeof(path), "%s/corners.vnl", dir);
	return observations_write(o, path, NULL) ? -EIO : 0;
}

/* Runs the tool in `dir`, whose output goes to a file there. */
static int run_tool(const char *dir, const struct observations *o)
{
	char *command;
	size_t size;
	FILE *text = open_memstream(&command, &size);

	if (!text)
		return -EIO;
	fprintf(text,
		"cd %s && OPENBLAS_NUM_THREADS=1 " PYTHON " " TOOL " --corners-cache corners.vnl "
		"--lensmodel " SOLVE_LENS_DEFAULT " --focal %g --imagersize %d %d "
		"--object-spacing %.17g --object-width-n %d --object-height-n %d",
		dir, FOCAL_PX, o->cameras[0].width_px, o->cameras[0].height_px, o->board.square_m,
		board_corners_x(&o->board), board_corners_y(&o->board));
	for (uint32_t c = 0; c < o->camera_count; c++)
		fprintf(text, " '%s-*.png'", o->cameras[c].name);
	fprintf(text, " >out.txt 2>&1");
	if (fclose(text))
		return -EIO;
	int status = system(command);
	free(command);
	return status ? -EIO : 0;
}

static int read_rms(const char *dir, double *rms_px)
{
	char path[PATH_MAX], line[512];
	const char *key = "## RMS error: ";
	int err = -EIO;

	snprintf(path, sizeof(path), "%s/out.txt", dir);
	FILE *file = fopen(path, "r");
	while (file && fgets(line, sizeof(line), file))
		if (!strncmp(line, key, strlen(key))) { /* the last one counts */
			*rms_px = atof(line + strlen(key));
			err = 0;
		}
	if (file)
		fclose(file);
	return err;
}

static int read_centres(const char *dir, uint32_t count, struct vec3 *centre_m)
{
	for (uint32_t c = 0; c < count; c++) {
		char path[PATH_MAX];

		snprintf(path, sizeof(path), "%s/camera-%u.cameramodel", dir, c);
		mrcal_cameramodel_t *model = mrcal_read_cameramodel_file(path);
		if (!model)
			return -EIO;
		struct pose rt_cam_ref = pose_from_rt(model->rt_cam_ref);
		centre_m[c] = pose_inverse(&rt_cam_ref).t;
		mrcal_free_cameramodel(&model);
	}
	return 0;
}

static void clean_up(const char *dir, uint32_t count)
{
	char path[PATH_MAX];

	for (uint32_t c = 0; c < count; c++) {
		snprintf(path, sizeof(path), "%s/camera-%u.cameramodel", dir, c);
		unlink(path);
	}
	snprintf(path, sizeof(path), "%s/corners.vnl", dir);
	unlink(path);
	snprintf(path, sizeof(path), "%s/out.txt", dir);
	unlink(path);
	rmdir(dir);
}

int tool_calibrate(struct tool_result *result, const struct observations *observations)
{
	char dir[] = "/tmp/bench-calibrationXXXXXX";

	if (access(TOOL, R_OK) || access(PYTHON, X_OK))
		return -ENOENT;
	if (!mkdtemp(dir))
		return -EIO;
	int64_t start_ns = clock_now_ns();
	int err = write_corners(dir, observations);
	if (!err)
		err = run_tool(dir, observations);
	result->seconds = (double)(clock_now_ns() - start_ns) * 1e-9;
	if (!err)
		err = read_rms(dir, &result->rms_px);
	if (!err)
		err = read_centres(dir, observations->camera_count, result->centre_m);
	clean_up(dir, observations->camera_count);
	return err;
}
