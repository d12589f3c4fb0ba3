/*
 * People and groups of the machine, and what the mode of a file lets them do.
 */
#pragma once

#include <stdbool.h>
#include <sys/stat.h>

#include "ctl/doctor/doctor.h"

/* By /etc/group below root; false when there is none such. */
bool group_find(const struct doctor *doctor, const char *name, gid_t *gid);

/* Whether /etc/group lists the user as a member. */
bool group_lists(const struct doctor *doctor, const char *group, const char *user);

/* A user of /etc/passwd with the groups of /etc/group; false when there is none such. */
bool person_find(const struct doctor *doctor, const char *name, struct person *out);

void person_add_group(struct person *person, gid_t gid);
bool person_in_group(const struct person *person, gid_t gid);

/* Read and write, by owner, group and mode. */
bool person_may_use(const struct person *person, const struct stat *st);
