/*
 * Through which network port a camera's address is reached.
 */
#pragma once

#include <net/if.h>
#include <netinet/in.h>
#include <stdbool.h>

#include "ctl/doctor/doctor.h"

struct route {
	char interface[IF_NAMESIZE];
	bool by_gateway; /* not in the port's own network */
	bool doubled;    /* another port has the same network */
};

/* As the kernel would choose, by /proc/net/route; false when there is no way. */
bool route_find(const struct doctor *doctor, struct in_addr to, struct route *out);
