/*
 * Python in a child process writes longer copies of the models; they are loaded as the station
 * would before they take their places.
 */
#include "ctl/calibrate/calibrate_finish.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include "calib/rig/rig_dir.h"
#include "calib/solve/mrcal_inputs.h"

#define PYTHON "/usr/bin/python3" /* the one that Debian's mrcal is for */
#define SECONDS_MAX 120
#define EXIT_NO_MRCAL 3
#define EXIT_TOO_LARGE 4

/* argv: where the models are, where to. A model's text is copied as it is; what mrcal adds comes
 * behind it. It is the same for all cameras but for the camera's number. */
static const char SCRIPT[] =
	"import json, sys\n"
	"try:\n"
	"    import numpy, mrcal\n"
	"except ImportError:\n"
	"    sys.exit(3)\n"
	"source, place = sys.argv[1:]\n"
	"file = sys.stdin.buffer\n"
	"facts = json.loads(file.readline())\n"
	"count, frames, views = len(facts['cameras']), facts['frames'], facts['views']\n"
	"width, height = facts['board']\n"
	"def take(*shape, dtype=float):\n"
	"    size = int(numpy.prod(shape)) * numpy.dtype(dtype).itemsize\n"
	"    return numpy.frombuffer(file.read(size), dtype=dtype).reshape(shape).copy()\n"
	"inputs = dict(\n"
	"    intrinsics=take(count, facts['lens_count']),\n"
	"    extrinsics_rt_fromref=take(count - 1, 6), frames_rt_toref=take(frames, 6),\n"
	"    points=None, calobject_warp=take(2),\n"
	"    observations_board=take(views, height, width, 3),\n"
	"    indices_frame_camintrinsics_camextrinsics=take(views, 3, dtype=numpy.int32),\n"
	"    observations_point=None, indices_point_camintrinsics_camextrinsics=None,\n"
	"    lensmodel=facts['lens'],\n"
	"    imagersizes=numpy.array([c[1:] for c in facts['cameras']], dtype=numpy.int32),\n"
	"    do_optimize_intrinsics_core=facts['core'],\n"
	"    do_optimize_intrinsics_distortions=True, do_optimize_extrinsics=True,\n"
	"    do_optimize_frames=True, do_optimize_calobject_warp=True,\n"
	"    calibration_object_spacing=facts['square_m'], do_apply_outlier_rejection=True,\n"
	"    do_apply_regularization=True, verbose=False,\n"
	"    imagepaths=None)\n"
	"model = mrcal.cameramodel(optimization_inputs=inputs, icam_intrinsics=0)\n"
	"key = \"    'optimization_inputs': \"\n"
	"line = next(l for l in str(model).splitlines() if l.startswith(key))\n"
	"if len(line) > 12 << 20:\n"
	"    sys.exit(4)\n"
	"for index, (name, _, _) in enumerate(facts['cameras']):\n"
	"    with open(f'{source}/{name}.cameramodel') as model:\n"
	"        text = model.read().rstrip()\n"
	"    assert text.endswith('}')\n"
	"    with open(f'{place}/{name}.cameramodel', 'x') as model:\n"
	"        model.write(f\"{text[:-1]}    'icam_intrinsics': {index},\\n{line}\\n}}\\n\")\n";

static void run_python(int input, const char *from, const char *to)
{
	const struct itimerval timer = {.it_value = {.tv_sec = SECONDS_MAX}};
	int null = open("/dev/null", O_WRONLY | O_CLOEXEC);

	prctl(PR_SET_PDEATHSIG, SIGKILL);
	signal(SIGALRM, SIG_DFL);
	setitimer(ITIMER_REAL, &timer, NULL); /* outlives exec */
	dup2(input, STDIN_FILENO);
	dup2(null, STDOUT_FILENO);
	dup2(null, STDERR_FILENO);
	execl(PYTHON, PYTHON, "-c", SCRIPT, from, to, (char *)NULL);
	_exit(EXIT_NO_MRCAL);
}

/* Its exit code, or a negative errno. */
static int call_python(int input, const char *from, const char *to)
{
	pid_t child = fork();
	int status;

	if (child < 0)
		return -errno;
	if (child == 0)
		run_python(input, from, to);
	while (waitpid(child, &status, 0) < 0)
		if (errno != EINTR)
			return -errno;
	return WIFEXITED(status) ? WEXITSTATUS(status) : -ETIMEDOUT;
}

static int lengthen(const struct calibrate_making *k, const char *to)
{
	FILE *input = tmpfile();
	int err = input ? mrcal_inputs_print(input, k->observations, &k->solution) : -errno;

	if (!err && lseek(fileno(input), 0, SEEK_SET) < 0)
		err = -errno;
	if (!err)
		err = call_python(fileno(input), k->revision_dir, to);
	if (input)
		fclose(input);
	return err;
}

/* The copies must be the same rig to the station. */
static int check(const struct calibrate_making *k, const char *dir)
{
	const struct observations *o = k->observations;
	char names[CAMERA_MAX][NAME_BYTES], revision[17];

	for (uint32_t c = 0; c < o->camera_count; c++)
		memcpy(names[c], o->cameras[c].name, NAME_BYTES);
	int err =
		rig_dir_try(dir, (const char(*)[NAME_BYTES])names, o->camera_count, revision, NULL);
	return err ? err : strcmp(revision, k->revision) ? -EINVAL : 0;
}

/* From `from` to `to`, or away when `to` is NULL. */
static int move_models(const struct calibrate_making *k, const char *from, const char *to)
{
	const struct observations *o = k->observations;
	char here[RIG_FILE_BYTES], there[RIG_FILE_BYTES];
	int err = 0;

	for (uint32_t c = 0; !err && c < o->camera_count; c++) {
		snprintf(here, sizeof(here), "%s/%s" RIG_MODEL_SUFFIX, from, o->cameras[c].name);
		if (to) {
			snprintf(there, sizeof(there), "%s/%s" RIG_MODEL_SUFFIX, to,
				 o->cameras[c].name);
			err = rename(here, there) ? -errno : 0;
		} else {
			unlink(here);
		}
	}
	return err;
}

static void tell(int result)
{
	if (result == 0)
		fprintf(stderr, "the models carry what they were made from: "
				"mrcal-show-residuals and mrcal-show-projection-uncertainty open "
				"them\n");
	else if (result == EXIT_NO_MRCAL)
		fprintf(stderr, "python3-mrcal is not installed: mrcal's residual and uncertainty "
				"tools cannot open these models; the station does not need it\n");
	else if (result == EXIT_TOO_LARGE)
		fprintf(stderr, "too many views for mrcal's residual and uncertainty tools to open "
				"these models; calibration.poses_max limits them\n");
	else
		fprintf(stderr,
			"mrcal's residual and uncertainty tools cannot open these models: %s; the "
			"station does not need it\n",
			result == -ETIMEDOUT ? "Python was stopped or took too long"
			: result > 0         ? "Python with mrcal failed"
					     : strerror(-result));
}

void calibrate_finish(const struct calibrate_making *making)
{
	char dir[PATH_MAX];
	int length = snprintf(dir, sizeof(dir), "%s.XXXXXX", making->revision_dir);

	if (length >= (int)sizeof(dir) || !mkdtemp(dir)) {
		tell(length >= (int)sizeof(dir) ? -ENAMETOOLONG : -errno);
		return;
	}
	int result = lengthen(making, dir);
	if (!result)
		result = check(making, dir);
	if (!result)
		result = move_models(making, dir, making->revision_dir);
	move_models(making, dir, NULL);
	rmdir(dir);
	tell(result);
}
