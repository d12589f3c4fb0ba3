/*
 * Reads mrcal camera models and builds the views of a rig from them.
 */
#include "config/rig.h"

#include <errno.h>
#include <inttypes.h>
#include <limits.h>
#include <mrcal/mrcal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/file.h"
#include "config/model_text.h"

#define MODEL_SIZE_MAX (16 << 20) /* a dense splined model has about a megabyte */

struct lens {
	mrcal_lensmodel_t model;
	const double *intrinsics;
};

static bool lens_project(const void *user, struct vec3 p_cam, double pixel[2])
{
	const struct lens *lens = user;
	mrcal_point3_t p = {.x = p_cam.x, .y = p_cam.y, .z = p_cam.z};
	mrcal_point2_t q;

	if (!mrcal_project(&q, NULL, NULL, &p, 1, &lens->model, lens->intrinsics))
		return false;
	pixel[0] = q.x;
	pixel[1] = q.y;
	return true;
}

static bool lens_unproject(const void *user, const double pixel[2], struct vec3 *v_cam)
{
	const struct lens *lens = user;
	mrcal_point2_t q = {.x = pixel[0], .y = pixel[1]};
	mrcal_point3_t v;

	if (!mrcal_unproject(&v, &q, 1, &lens->model, lens->intrinsics))
		return false;
	*v_cam = (struct vec3){v.x, v.y, v.z};
	return isfinite(v.x) && isfinite(v.y) && isfinite(v.z);
}

static struct pose pose_from_mrcal(const double rt[6])
{
	struct pose pose = pose_from_rotation_vector((struct vec3){rt[0], rt[1], rt[2]});

	pose.t = (struct vec3){rt[3], rt[4], rt[5]};
	return pose;
}

static int build_view(struct view *view, const mrcal_cameramodel_t *model, const char *path,
		      struct diag *diag)
{
	struct lens lens = {.model = model->lensmodel, .intrinsics = model->intrinsics};
	struct lens_model calls = {lens_project, lens_unproject, &lens};
	double bad[2] = {0, 0};
	int err = view_init(view, (int)model->imagersize[0], (int)model->imagersize[1],
			    pose_from_mrcal(model->rt_cam_ref), &calls, bad);

	if (err == -EDOM)
		diag_add(diag,
			 "%s: intrinsics: the lens model cannot be inverted at pixel (%.0f, %.0f); "
			 "recalibrate or restore the file",
			 path, bad[0], bad[1]);
	else if (err)
		diag_add(diag, "%s: %s", path, strerror(-err));
	return err == -EDOM ? -EINVAL : err;
}

/* FNV-1a, 64 bits. */
static uint64_t digest(uint64_t hash, const void *bytes, size_t count)
{
	for (size_t i = 0; i < count; i++)
		hash = (hash ^ ((const unsigned char *)bytes)[i]) * UINT64_C(0x100000001b3);
	return hash;
}

/* What projects, and not the text around it: a model may also carry what it was made from. */
static uint64_t digest_model(uint64_t hash, const mrcal_cameramodel_t *model)
{
	size_t numbers = (size_t)mrcal_lensmodel_num_params(&model->lensmodel);
	char lens[256];

	mrcal_lensmodel_name(lens, sizeof(lens), &model->lensmodel);
	hash = digest(hash, lens, strlen(lens) + 1);
	hash = digest(hash, model->intrinsics, numbers * sizeof(*model->intrinsics));
	hash = digest(hash, model->rt_cam_ref, sizeof(model->rt_cam_ref));
	return digest(hash, model->imagersize, sizeof(model->imagersize));
}

static int load_model(struct view *view, const char *path, uint64_t *hash, struct diag *diag)
{
	char *text;
	size_t size;

	if (access(path, F_OK) < 0) {
		diag_add(diag, "%s: %s; a rig has a model named like each of its cameras", path,
			 strerror(errno));
		return -EINVAL;
	}
	int err = file_read(&text, &size, path, MODEL_SIZE_MAX, diag);
	if (err)
		return err;
	err = model_text_check(text, size, path, diag);
	if (err)
		goto done;

	mrcal_cameramodel_t *model = mrcal_read_cameramodel_string(text, (int)size);

	if (!model) {
		diag_add(diag,
			 "%s: not a camera model that libmrcal reads; recalibrate or restore the "
			 "file",
			 path);
		err = -EINVAL;
		goto done;
	}
	err = build_view(view, model, path, diag);
	*hash = digest_model(*hash, model);
	mrcal_free_cameramodel(&model);
done:
	free(text);
	return err;
}

/* The directory that is loaded, also when a link to it changes meanwhile. */
static void find_place(char place[PATH_MAX], const char *dir)
{
	struct stat st;

	if (lstat(dir, &st) || !S_ISLNK(st.st_mode) || !realpath(dir, place))
		snprintf(place, PATH_MAX, "%s", dir);
}

uint32_t rig_revision_number(const char *place)
{
	const char *slash = strrchr(place, '/');
	const char *name = slash ? slash + 1 : place;

	if (strlen(name) != 4 || strspn(name, "0123456789") != 4)
		return 0;
	return (uint32_t)strtoul(name, NULL, 10);
}

int rig_load(struct rig *rig, const char *dir, const char (*names)[NAME_BYTES], uint32_t count,
	     struct diag *diag)
{
	struct rig made = {.camera_count = count};
	uint64_t hash = UINT64_C(0xcbf29ce484222325);
	char place[PATH_MAX];
	struct stat st;
	int result = 0;

	find_place(place, dir);
	made.number = rig_revision_number(place);
	if (stat(place, &st) < 0 || !S_ISDIR(st.st_mode)) {
		diag_add(diag,
			 "%s: not a directory; a rig is a directory of NAME.cameramodel files",
			 dir);
		return -EINVAL;
	}
	for (uint32_t i = 0; i < count; i++) {
		char path[PATH_MAX + NAME_BYTES + sizeof("/.cameramodel")];

		snprintf(made.names[i], NAME_BYTES, "%s", names[i]);
		snprintf(path, sizeof(path), "%s/%s.cameramodel", place, names[i]);
		hash = digest(hash, names[i], strlen(names[i]) + 1);
		int err = load_model(&made.views[i], path, &hash, diag);
		if (err && result != -ENOMEM)
			result = err == -ENOMEM ? -ENOMEM : -EINVAL;
	}
	if (result) {
		rig_finish(&made);
		return result;
	}
	snprintf(made.revision, sizeof(made.revision), "%016" PRIx64, hash);
	*rig = made;
	return 0;
}

void rig_finish(struct rig *rig)
{
	for (uint32_t i = 0; i < rig->camera_count; i++)
		view_finish(&rig->views[i]);
	memset(rig, 0, sizeof(*rig));
}

int rig_check_size(const struct rig *rig, uint32_t camera, int width_px, int height_px,
		   struct diag *diag)
{
	const struct view *view = &rig->views[camera];

	if (view->width_px == width_px && view->height_px == height_px)
		return 0;
	diag_add(diag,
		 "camera %s: images are %dx%d but the rig's %s.cameramodel was made for %dx%d "
		 "(imagersize); set the camera's width and height or use the rig of this camera",
		 rig->names[camera], width_px, height_px, rig->names[camera], view->width_px,
		 view->height_px);
	return -EINVAL;
}
