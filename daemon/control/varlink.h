/*
 * Replies as varlink wants them, and the interface that every varlink service has.
 */
#pragma once

#include <jansson.h>
#include <stdbool.h>

/* All take the parameters over. */
json_t *varlink_result(json_t *parameters);
json_t *varlink_continues(json_t *parameters); /* more replies follow */
json_t *varlink_error(const char *error, json_t *parameters);
json_t *varlink_invalid_parameter(const char *name);

/* The reply to a method of org.varlink.service, or NULL when `method` is of another interface. */
json_t *varlink_service_call(const char *method, const json_t *parameters);
