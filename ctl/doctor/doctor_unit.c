/*
 * Reads the unit as systemd would find it: the machine's own file before the package's, then the
 * drop-ins.
 */
#include "ctl/doctor/doctor_unit.h"

#include <stdlib.h>
#include <string.h>

#include "ctl/doctor/doctor_tree.h"

#define UNIT "staged.service"

static const char *const directories[] = {"/etc/systemd/system", "/usr/local/lib/systemd/system",
					  "/usr/lib/systemd/system", "/lib/systemd/system"};

#define DIRECTORY_COUNT (sizeof(directories) / sizeof(directories[0]))

static bool find_unit(const struct doctor *doctor, char path[128])
{
	for (size_t d = 0; d < DIRECTORY_COUNT; d++) {
		snprintf(path, 128, "%s/" UNIT, directories[d]);
		if (tree_exists(doctor, path))
			return true;
	}
	return false;
}

bool unit_installed(const struct doctor *doctor)
{
	char path[128];

	return find_unit(doctor, path);
}

static bool read_from(const struct doctor *doctor, const char *path, const char *directive,
		      char *value, size_t size)
{
	FILE *file = tree_open(doctor, path);
	size_t length = strlen(directive);
	char line[512];
	bool found = false;

	while (file && fgets(line, sizeof(line), file)) {
		line[strcspn(line, "\n")] = '\0';
		if (strncmp(line, directive, length) != 0 || line[length] != '=')
			continue;
		snprintf(value, size, "%s", line + length + 1);
		found = true;
	}
	if (file)
		fclose(file);
	return found;
}

bool unit_read(const struct doctor *doctor, const char *directive, char *value, size_t size)
{
	char path[128];
	bool found = find_unit(doctor, path) && read_from(doctor, path, directive, value, size);
	glob_t drop_ins;

	tree_glob(doctor, "/etc/systemd/system/" UNIT ".d/*.conf", &drop_ins);
	for (size_t i = 0; i < drop_ins.gl_pathc; i++)
		found |= read_from(doctor, tree_name(doctor, drop_ins.gl_pathv[i]), directive,
				   value, size);
	globfree(&drop_ins);
	return found;
}

uint64_t unit_amount(const char *value)
{
	char *end;
	unsigned long long number = strtoull(value, &end, 10);

	if (strncmp(value, "infinity", 8) == 0)
		return UINT64_MAX;
	switch (*end) {
	case 'K':
		return number << 10;
	case 'M':
		return number << 20;
	case 'G':
		return number << 30;
	default:
		return number;
	}
}
