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

/* For drivers on devices that are a part of the program. */
extern const struct trigger_plan trigger_contract_fast_plan;

/* Runs every test; returns how many failed. TAP goes to standard output. */
int trigger_contract_run(const struct trigger_contract *contract);

/* The same as a whole program, on a device of this machine: argv[1] is the address behind the
 * colon, the rest are files that read 0 while a line is dark. Without an address it says that it
 * skips, for want of `device`. Returns what main() is to return. */
int trigger_contract_main(int argc, char **argv, const struct trigger_driver *driver,
			  const char *bad_rest, const char *device);
