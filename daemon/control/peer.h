/*
 * Who may do what over the control socket: by the credentials that the kernel vouches for.
 */
#pragma once

#include <stddef.h>
#include <sys/types.h>

enum permission {
	PERMISSION_NONE,
	PERMISSION_LOOK,    /* group `stage`: status and images */
	PERMISSION_COMMAND, /* group `stage-operator`: everything */
};

#define PEER_GROUP_LOOK "stage"
#define PEER_GROUP_COMMAND "stage-operator"
#define GID_NONE ((gid_t)-1) /* the machine has no such group */

struct peer_rules {
	uid_t masters[2]; /* may do everything */
	gid_t look, command;
};

/* root, our own user, and the two groups as the machine knows them. Looks them up once: that may
 * take a while and allocates. */
struct peer_rules peer_rules_of_this_machine(void);

/* Pure. `groups`: the peer's own group and its supplementary ones. */
enum permission peer_permission(const struct peer_rules *rules, uid_t uid, const gid_t *groups,
				size_t group_count);

/* Of the process that connected to this Unix socket, as it was then; NONE when the kernel does not
 * tell. */
enum permission peer_permission_of_socket(const struct peer_rules *rules, int fd);
