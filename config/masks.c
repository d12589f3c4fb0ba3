/*
 * Masks in YAML.
 */
#include "config/masks.h"

#include <errno.h>
#include <stddef.h>
#include <string.h>
#include <unistd.h>

#include "config/yaml.h"

#define FILE_SIZE_MAX (1 << 16)

#define AREA_NUMBER(member, low)                                                          \
	.kind = YAML_INT, .offset = offsetof(struct mask_area, member), .required = true, \
	.min = (low), .max = 16384, .unit = "pixels"

static const struct yaml_key area_keys[] = {
	{"x", AREA_NUMBER(x_px, 0)},
	{"y", AREA_NUMBER(y_px, 0)},
	{"width", AREA_NUMBER(width_px, 1)},
	{"height", AREA_NUMBER(height_px, 1)},
	{0},
};

static void read_area(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	struct mask *mask = target;

	yaml_read_mapping(yaml, value, area_keys, &mask->areas[mask->area_count++], NULL);
}

void mask_read(struct yaml *yaml, const struct yaml_value *value, struct mask *mask)
{
	yaml_read_list(yaml, value, MASK_AREA_MAX, "areas", read_area, mask);
}

static void read_areas(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	mask_read(yaml, value, &((struct named_mask *)target)->mask);
}

static const struct yaml_key camera_keys[] = {
	{"camera", YAML_NAME, offsetof(struct named_mask, camera), true, .size = NAME_BYTES},
	{"mask", YAML_CUSTOM, .required = true, .read = read_areas},
	{0},
};

/* NULL when it has none. */
static struct mask *find_mask(struct masks *masks, const char *camera)
{
	for (uint32_t c = 0; c < masks->count; c++)
		if (strcmp(masks->cameras[c].camera, camera) == 0)
			return &masks->cameras[c].mask;
	return NULL;
}

static void read_camera(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	struct masks *masks = target;
	struct named_mask camera = {0};

	yaml_read_mapping(yaml, value, camera_keys, &camera, NULL);
	if (*camera.camera && find_mask(masks, camera.camera))
		yaml_complain(yaml, value->place, value->field, "camera %s was there before",
			      camera.camera);
	masks->cameras[masks->count++] = camera;
}

static void read_cameras(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	yaml_read_list(yaml, value, CAMERA_MAX, "cameras", read_camera, target);
}

static const struct yaml_key file_keys[] = {
	{"masks", YAML_CUSTOM, .required = true, .read = read_cameras},
	{0},
};

int masks_load(struct masks *masks, const char *path, struct diag *diag)
{
	struct masks made = {0};
	struct yaml_value root;
	struct yaml yaml;
	int err;

	if (access(path, F_OK) < 0 && errno == ENOENT) {
		*masks = made;
		return 0;
	}
	err = yaml_open(&yaml, path, FILE_SIZE_MAX, diag);
	if (err)
		return err;
	root = yaml_root(&yaml);
	yaml_read_mapping(&yaml, &root, file_keys, &made, NULL);
	err = yaml.failed ? -EINVAL : 0;
	yaml_close(&yaml);
	if (!err)
		*masks = made;
	return err;
}

void masks_write(const struct masks *masks, FILE *file)
{
	fputs("# Written by stagectl camera mask.\nmasks:", file);
	if (!masks->count)
		fputs(" []", file);
	fputc('\n', file);
	for (uint32_t c = 0; c < masks->count; c++) {
		const struct mask *mask = &masks->cameras[c].mask;

		fprintf(file, "- camera: %s\n  mask:%s\n", masks->cameras[c].camera,
			mask->area_count ? "" : " []");
		for (uint32_t a = 0; a < mask->area_count; a++)
			fprintf(file, "  - {x: %d, y: %d, width: %d, height: %d}\n",
				mask->areas[a].x_px, mask->areas[a].y_px, mask->areas[a].width_px,
				mask->areas[a].height_px);
	}
}

int masks_set(struct masks *masks, const char *camera, const struct mask *mask)
{
	struct mask *found = find_mask(masks, camera);

	if (!found && masks->count == CAMERA_MAX)
		return -ENOSPC;
	if (!found) {
		snprintf(masks->cameras[masks->count].camera, NAME_BYTES, "%s", camera);
		found = &masks->cameras[masks->count++].mask;
	}
	*found = *mask;
	return 0;
}
