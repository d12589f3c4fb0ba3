/*
 * A rig's files from a solution.
 */
#include "calib/rig/rig_write.h"

#include <errno.h>
#include <string.h>

#include "calib/rig/rig_dir.h"
#include "calib/rig/rig_facts.h"
#include "calib/rt.h"

static void print_list(FILE *file, const char *key, const double *values, uint32_t count)
{
	fprintf(file, "    '%s': [", key);
	for (uint32_t i = 0; i < count; i++)
		fprintf(file, " %.17g,", values[i]);
	fprintf(file, " ],\n");
}

static int write_model(const char *dir, const struct rig_facts *facts, uint32_t c,
		       struct diag *diag)
{
	const struct solution *solution = facts->solution;
	const struct observed_camera *camera = &facts->observations->cameras[c];
	struct pose rt_cam_ref = pose_from_rt(solution->rt_cam_ref[c]);
	struct pose rt_ref_stage = pose_inverse(&facts->rt_stage_ref);
	struct pose rt_cam_stage = pose_compose(&rt_cam_ref, &rt_ref_stage);
	char path[RIG_FILE_BYTES], name[NAME_BYTES + sizeof(RIG_MODEL_SUFFIX)];
	double rt[6];

	snprintf(name, sizeof(name), "%s" RIG_MODEL_SUFFIX, camera->name);
	FILE *file = rig_dir_file(dir, name, path, diag);
	if (!file)
		return -EIO;
	pose_to_rt(&rt_cam_stage, rt);
	fprintf(file, "{\n    'lensmodel': '%s',\n", solution->lens);
	print_list(file, "intrinsics", solution->intrinsics + c * solution->lens_count,
		   solution->lens_count);
	print_list(file, "extrinsics", rt, 6); /* mrcal: rt_cam_ref; the reference is the stage */
	fprintf(file, "    'imagersize': [ %d, %d ],\n}\n", camera->width_px, camera->height_px);
	return rig_dir_finish_file(file, path, diag);
}

struct writing {
	const struct rig_facts *facts;
	char revision[17];
};

static int write_facts(const char *dir, const struct writing *writing, struct diag *diag)
{
	char path[RIG_FILE_BYTES];
	FILE *file = rig_dir_file(dir, "rig.yaml", path, diag);

	if (!file)
		return -EIO;
	rig_facts_print(file, writing->facts, writing->revision);
	return rig_dir_finish_file(file, path, diag);
}

static int try_rig(const char *dir, struct writing *writing, struct diag *diag)
{
	const struct observations *o = writing->facts->observations;
	char names[CAMERA_MAX][NAME_BYTES];

	for (uint32_t c = 0; c < o->camera_count; c++)
		memcpy(names[c], o->cameras[c].name, NAME_BYTES);
	return rig_dir_try(dir, (const char(*)[NAME_BYTES])names, o->camera_count,
			   writing->revision, diag);
}

static int fill(const char *dir, void *user, struct diag *diag)
{
	struct writing *writing = user;
	int err = 0;

	for (uint32_t c = 0; !err && c < writing->facts->solution->camera_count; c++)
		err = write_model(dir, writing->facts, c, diag);
	if (!err)
		err = try_rig(dir, writing, diag);
	return err ? err : write_facts(dir, writing, diag);
}

int rig_write(const char *dir, const struct rig_facts *facts, char revision[17], struct diag *diag)
{
	struct writing writing = {.facts = facts};
	int err = rig_dir_make(dir, fill, &writing, diag);

	if (!err)
		memcpy(revision, writing.revision, sizeof(writing.revision));
	return err;
}
