/*
 * SO_PEERCRED gives user and group, SO_PEERGROUPS the supplementary groups: both are what the peer
 * process really has, and need no lookup that could keep the control thread waiting.
 */
#include "daemon/control/peer.h"

#include <errno.h>
#include <grp.h>
#include <stdbool.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <unistd.h>

#define GROUPS_MAX 65536 /* NGROUPS_MAX of Linux */

static gid_t group_id(const char *name)
{
	const struct group *group = getgrnam(name);

	return group ? group->gr_gid : GID_NONE;
}

struct peer_rules peer_rules_of_this_machine(void)
{
	return (struct peer_rules){.masters = {0, geteuid()},
				   .look = group_id(PEER_GROUP_LOOK),
				   .command = group_id(PEER_GROUP_COMMAND)};
}

static bool has_group(gid_t wanted, const gid_t *groups, size_t group_count)
{
	for (size_t g = 0; g < group_count; g++)
		if (wanted != GID_NONE && groups[g] == wanted)
			return true;
	return false;
}

enum permission peer_permission(const struct peer_rules *rules, uid_t uid, const gid_t *groups,
				size_t group_count)
{
	if (uid == rules->masters[0] || uid == rules->masters[1] ||
	    has_group(rules->command, groups, group_count))
		return PERMISSION_COMMAND;
	return has_group(rules->look, groups, group_count) ? PERMISSION_LOOK : PERMISSION_NONE;
}

/* The supplementary groups with room for one more at the end, or NULL. The caller frees them. */
static gid_t *supplementary_groups(int fd, size_t *count)
{
	socklen_t bytes = 0;
	gid_t *groups = NULL;

	if (getsockopt(fd, SOL_SOCKET, SO_PEERGROUPS, NULL, &bytes) < 0 && errno != ERANGE)
		return NULL;
	if (bytes <= GROUPS_MAX * sizeof(*groups))
		groups = malloc(bytes + sizeof(*groups));
	if (groups && bytes && getsockopt(fd, SOL_SOCKET, SO_PEERGROUPS, groups, &bytes) < 0) {
		free(groups);
		return NULL;
	}
	*count = bytes / sizeof(*groups);
	return groups;
}

enum permission peer_permission_of_socket(const struct peer_rules *rules, int fd)
{
	struct ucred peer;
	socklen_t bytes = sizeof(peer);
	size_t count = 0;

	if (getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &bytes) < 0)
		return PERMISSION_NONE;
	gid_t *groups = supplementary_groups(fd, &count);
	if (!groups)
		return peer_permission(rules, peer.uid, &peer.gid, 1);
	groups[count] = peer.gid;
	enum permission permission = peer_permission(rules, peer.uid, groups, count + 1);
	free(groups);
	return permission;
}
