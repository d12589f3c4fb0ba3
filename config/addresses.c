/*
 * What the drivers say is told with its place in the file, beside all else that is wrong there.
 */
#include "config/addresses.h"

#include <string.h>

static void tell(struct yaml *yaml, struct yaml_place place, const char *field, struct diag *said)
{
	const char *line = said->text ? said->text : "";

	for (const char *end; (end = strchr(line, '\n')); line = end + 1)
		yaml_complain(yaml, place, field, "%.*s", (int)(end - line), line);
	diag_finish(said);
}

void addresses_ask(struct yaml *yaml, const struct config *config,
		   const struct config_drivers *drivers, struct yaml_place trigger)
{
	struct diag said = {0};

	drivers->trigger(config, !yaml->failed, &said);
	tell(yaml, trigger, "trigger", &said);
	for (uint32_t c = 0; c < config->camera_count; c++) {
		const struct config_camera *camera = &config->cameras[c];
		struct yaml_place place = {camera->line, camera->column};
		char field[YAML_FIELD_BYTES];

		if (!*camera->address)
			continue; /* missing, and said so */
		snprintf(field, sizeof(field), "cameras[%u].address", c);
		drivers->camera(camera->address, &said);
		tell(yaml, place, field, &said);
	}
}
