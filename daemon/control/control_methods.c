/*
 * The methods of org.stage.Control: a table with who may call them.
 * protocol/org.stage.Control.varlink describes them to the world.
 */
#include "daemon/control/control_methods.h"

#include <string.h>

#include "base/log.h"

json_t *too_many(int most)
{
	return varlink_error("org.stage.Control.TooMany", json_pack("{s:i}", "limit", most));
}

/* One who follows stays for ever: the last places are not for it. */
static json_t *get_status(struct call *call)
{
	if (call->more && call->context->stats->follower_count >= CONTROL_FOLLOWER_MAX)
		return too_many(CONTROL_FOLLOWER_MAX);
	if (call->more)
		call->wait->kind = WAIT_STATUS;
	return status_reply(call->context, call->more);
}

json_t *status_reply(const struct control_context *context, bool more)
{
	json_t *parameters = json_pack("{s:o}", "status", station_status_json(context));

	return more ? varlink_continues(parameters) : varlink_result(parameters);
}

static json_t *messages_json(const struct diag *diag)
{
	json_t *messages = json_array();

	for (const char *line = diag->text; line && *line;) {
		size_t length = strcspn(line, "\n");
		json_t *message = json_stringn(line, length);

		json_array_append_new(messages, message ? message : json_string("(not UTF-8)"));
		line += length + (line[length] == '\n');
	}
	return messages;
}

json_t *wrong_state(const struct call *call)
{
	return varlink_error("org.stage.Control.WrongState",
			     json_pack("{s:s, s:s}", "method", call->method, "state",
				       station_state_name(call->context->station->state)));
}

static json_t *state_reply(const struct station *station)
{
	return varlink_result(json_pack("{s:s, s:i}", "state", station_state_name(station->state),
					"run", (int)station->run));
}

json_t *failed_reply(enum exit_code code, const struct diag *diag)
{
	return varlink_error(
		"org.stage.Control.Failed",
		json_pack("{s:i, s:o}", "exit_code", (int)code, "messages", messages_json(diag)));
}

static json_t *begin(struct call *call, enum station_event how)
{
	struct station *station = call->context->station;
	struct diag diag = {0};
	enum exit_code code = station_start(station, how, &diag);
	json_t *reply = code == EXIT_CODE_OK        ? state_reply(station)
			: code == EXIT_CODE_RUNNING ? wrong_state(call)
						    : failed_reply(code, &diag);

	if (code == EXIT_CODE_OK)
		log_info("%s, told by an operator", station_state_name(station->state));
	diag_finish(&diag);
	return reply;
}

static json_t *start(struct call *call)
{
	return begin(call, STATION_START);
}

/* With `more` it lasts as long as the client, which may be killed. */
static json_t *calibrate(struct call *call)
{
	const struct station *station = call->context->station;
	json_t *reply = begin(call, STATION_CALIBRATE);

	if (call->more && !json_object_get(reply, "error")) {
		json_object_set_new(reply, "continues", json_true());
		*call->wait = (struct wait){.kind = WAIT_HOLD, .run = station->run};
	}
	return reply;
}

static bool calibrates(const struct station *station, uint32_t run)
{
	return station->run == run &&
	       (station->state == STATION_CALIBRATING || station->state == STATION_ENDED);
}

json_t *calibrated_reply(const struct station *station, uint32_t run)
{
	return calibrates(station, run) ? NULL : state_reply(station);
}

void calibrated_by_nobody(struct station *station, uint32_t run)
{
	if (calibrates(station, run) && station_stop(station))
		log_warning("stopped calibrating: the program that did is gone");
}

static json_t *pictures(struct call *call)
{
	const struct pictures_share *share = &call->context->station->pictures;

	if (!share->memory)
		return wrong_state(call);
	*call->fd = share->fd;
	return varlink_result(json_pack("{s:I}", "size_bytes", (json_int_t)share->size_bytes));
}

static json_t *stop(struct call *call)
{
	struct station *station = call->context->station;

	if (!station_stop(station))
		return wrong_state(call);
	log_info("stopped, told by an operator");
	return state_reply(station);
}

static json_t *advance(struct call *call)
{
	return virtual_time_advance(&call->context->station->virtual_time, call->parameters);
}

static const struct method {
	const char *name;
	enum permission needed;
	json_t *(*run)(struct call *call);
} methods[] = {
	{"org.stage.Control.GetStatus", PERMISSION_LOOK, get_status},
	{"org.stage.Control.Preview", PERMISSION_LOOK, control_preview},
	{"org.stage.Control.Pictures", PERMISSION_LOOK, pictures},
	{"org.stage.Control.Observe", PERMISSION_LOOK, control_observe},
	{"org.stage.Control.Start", PERMISSION_COMMAND, start},
	{"org.stage.Control.Calibrate", PERMISSION_COMMAND, calibrate},
	{"org.stage.Control.Stop", PERMISSION_COMMAND, stop},
	{"org.stage.Control.ReloadRig", PERMISSION_COMMAND, control_reload_rig},
	{"org.stage.Control.SetMask", PERMISSION_COMMAND, control_set_mask},
	{"org.stage.Control.Advance", PERMISSION_COMMAND, advance},
};

static json_t *permission_denied(const struct method *method)
{
	return varlink_error("org.stage.Control.PermissionDenied",
			     json_pack("{s:s, s:s}", "method", method->name, "group",
				       method->needed == PERMISSION_LOOK ? PEER_GROUP_LOOK
									 : PEER_GROUP_COMMAND));
}

json_t *control_call(const struct control_context *context, enum permission permission,
		     const json_t *request, struct wait *wait, int *fd)
{
	struct call call = {.context = context,
			    .method = json_string_value(json_object_get(request, "method")),
			    .parameters = json_object_get(request, "parameters"),
			    .more = json_is_true(json_object_get(request, "more")),
			    .wait = wait,
			    .fd = fd};

	if (call.parameters && !json_is_object(call.parameters))
		return varlink_invalid_parameter("parameters");
	json_t *reply = varlink_service_call(call.method, call.parameters);
	if (reply)
		return reply;
	for (size_t m = 0; m < sizeof(methods) / sizeof(methods[0]); m++)
		if (strcmp(methods[m].name, call.method) == 0)
			return permission >= methods[m].needed ? methods[m].run(&call)
							       : permission_denied(&methods[m]);
	return varlink_error("org.varlink.service.MethodNotFound",
			     json_pack("{s:s}", "method", call.method));
}
