/*
 * The longest prefix, then the lowest metric.
 */
#include "ctl/doctor/doctor_route.h"

#include <net/route.h>
#include <stdio.h>
#include <string.h>

#include "ctl/doctor/doctor_tree.h"

struct line {
	char interface[IF_NAMESIZE];
	in_addr_t to, mask; /* in network order, as the kernel prints them */
	unsigned int flags;
	int metric;
};

static bool read_line(FILE *file, struct line *out)
{
	char text[256];

	while (fgets(text, sizeof(text), file))
		if (sscanf(text, "%15s %x %*x %x %*d %*d %d %x", out->interface, &out->to,
			   &out->flags, &out->metric, &out->mask) == 5 &&
		    (out->flags & RTF_UP))
			return true;
	return false;
}

static bool is_better(const struct line *line, const struct line *best)
{
	in_addr_t mask = ntohl(line->mask), best_mask = ntohl(best->mask);

	return mask > best_mask || (mask == best_mask && line->metric < best->metric);
}

static bool is_local(struct in_addr to)
{
	return ntohl(to.s_addr) >> 24 == IN_LOOPBACKNET;
}

bool route_find(const struct doctor *doctor, struct in_addr to, struct route *out)
{
	FILE *file = tree_open(doctor, "/proc/net/route");
	struct line line, best;
	bool found = false, doubled = false;

	if (is_local(to)) {
		*out = (struct route){.interface = "lo"};
		found = true;
	}
	while (file && !is_local(to) && read_line(file, &line)) {
		if ((to.s_addr & line.mask) != line.to)
			continue;
		if (found && line.mask == best.mask) {
			doubled |= line.mask && strcmp(line.interface, best.interface) != 0;
		} else if (found && is_better(&line, &best)) {
			doubled = false;
		}
		if (!found || is_better(&line, &best))
			best = line;
		found = true;
	}
	if (file)
		fclose(file);
	if (found && !is_local(to)) {
		*out = (struct route){.by_gateway = best.flags & RTF_GATEWAY, .doubled = doubled};
		memcpy(out->interface, best.interface, sizeof(out->interface));
	}
	return found;
}
