/*
 * Some keys of rig.yaml.
 */
#include "config/rig_worth.h"

#include <errno.h>
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "config/yaml.h"

#define FILE_SIZE_MAX (1 << 20)

#define AT(member) .offset = offsetof(struct rig_worth, member)
#define TEXT(member) .kind = YAML_TEXT, AT(member), .size = RIG_WORTH_TEXT
#define NUMBER(member, words) .kind = YAML_DOUBLE, AT(member), .min = 0, .max = 1e6, .unit = (words)

struct reading {
	struct rig_worth worth;
	bool passed;
};

static const struct yaml_key keys[] = {
	{"revision", TEXT(revision)},
	{"software", TEXT(software)},
	{"made_by", TEXT(made_by)},
	{"made_from", TEXT(made_from)},
	{"poses", .kind = YAML_INT, AT(poses), .min = 0, .max = 1e6, .unit = "poses"},
	{"rms_px", NUMBER(rms_px, "pixels")},
	{"held_out_rms_px", NUMBER(held_out_px, "pixels")},
	{"passed", .kind = YAML_BOOL, .offset = offsetof(struct reading, passed)},
	{0},
};

static const struct yaml_key uncertainty_keys[] = {
	{"worst_mm", NUMBER(worst_mm, "millimetres")},
	{0},
};

/* As yaml_read_mapping(), but a later program may have written more keys. */
static void read_known(struct yaml *yaml, const struct yaml_value *mapping,
		       const struct yaml_key *known, struct reading *reading)
{
	char name[RIG_WORTH_TEXT], field[YAML_FIELD_BYTES];
	struct yaml_value item;
	void *iterator = NULL;

	while (yaml_next_pair(yaml, mapping, &iterator, name, sizeof(name), &item, field)) {
		if (known == keys && !strcmp(name, "uncertainty"))
			read_known(yaml, &item, uncertainty_keys, reading);
		for (const struct yaml_key *key = known; key->name; key++)
			if (!strcmp(name, key->name))
				yaml_read_scalar(yaml, &item, key, (char *)reading + key->offset);
		reading->worth.judged |= !strcmp(name, "passed");
	}
}

int rig_worth_load(struct rig_worth *worth, const char *path, struct diag *diag)
{
	struct reading reading = {.worth = {.rms_px = NAN, .held_out_px = NAN, .worst_mm = NAN}};
	struct yaml yaml;
	int err = yaml_open(&yaml, path, FILE_SIZE_MAX, diag);

	if (err)
		return err;
	struct yaml_value root = yaml_root(&yaml);
	read_known(&yaml, &root, keys, &reading);
	err = yaml.failed ? -EINVAL : 0;
	yaml_close(&yaml);
	if (err)
		return err;
	reading.worth.failed = reading.worth.judged && !reading.passed;
	*worth = reading.worth;
	return 0;
}
