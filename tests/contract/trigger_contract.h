/*
 * What drivers/trigger.h promises, as tests of any driver that reports its edges.
 */
#pragma once

#include "drivers/trigger.h"

struct trigger_contract {
	const struct trigger_driver *driver;
	const char *rest;                /* an address that works, behind the colon */
	const char *bad_rest;            /* one that does not */
	const char *const *dark;         /* files that read 0 while a line is dark, ended by NULL */
	const struct trigger_plan *plan; /* that it can be armed with; has a strobe */
};

/* Runs every test; returns how many failed. TAP goes to standard output. */
int trigger_contract_run(const struct trigger_contract *contract);
