/*
 * org.varlink.service. The texts of the interfaces stand in protocol/, one file each.
 */
#include "daemon/control/varlink.h"

#include <string.h>

#include "interfaces.h"

json_t *varlink_result(json_t *parameters)
{
	return json_pack("{s:o}", "parameters", parameters);
}

json_t *varlink_continues(json_t *parameters)
{
	return json_pack("{s:o, s:b}", "parameters", parameters, "continues", true);
}

json_t *varlink_error(const char *error, json_t *parameters)
{
	return json_pack("{s:s, s:o}", "error", error, "parameters", parameters);
}

json_t *varlink_invalid_parameter(const char *name)
{
	return varlink_error("org.varlink.service.InvalidParameter",
			     json_pack("{s:s}", "parameter", name));
}

static json_t *get_info(void)
{
	return varlink_result(json_pack("{s:s, s:s, s:s, s:s, s:[s,s]}", "vendor", "stage",
					"product", "staged", "version", STAGE_VERSION, "url", "",
					"interfaces", "org.varlink.service", "org.stage.Control"));
}

static json_t *get_interface_description(const json_t *parameters)
{
	const char *name = json_string_value(json_object_get(parameters, "interface"));
	const char *text = NULL;

	if (!name)
		return varlink_invalid_parameter("interface");
	if (strcmp(name, "org.varlink.service") == 0)
		text = interface_service;
	else if (strcmp(name, "org.stage.Control") == 0)
		text = interface_control;
	if (!text)
		return varlink_error("org.varlink.service.InterfaceNotFound",
				     json_pack("{s:s}", "interface", name));
	return varlink_result(json_pack("{s:s}", "description", text));
}

json_t *varlink_service_call(const char *method, const json_t *parameters)
{
	static const char prefix[] = "org.varlink.service.";

	if (strncmp(method, prefix, sizeof(prefix) - 1) != 0)
		return NULL;
	if (strcmp(method + sizeof(prefix) - 1, "GetInfo") == 0)
		return get_info();
	if (strcmp(method + sizeof(prefix) - 1, "GetInterfaceDescription") == 0)
		return get_interface_description(parameters);
	return varlink_error("org.varlink.service.MethodNotFound",
			     json_pack("{s:s}", "method", method));
}
