/*
 * Reads /etc/passwd and /etc/group: stage's own groups are made there, and tests have theirs.
 */
#include "ctl/doctor/doctor_person.h"

#include <grp.h>
#include <pwd.h>
#include <stdio.h>
#include <string.h>

#include "ctl/doctor/doctor_tree.h"

static bool is_member(const struct group *group, const char *user)
{
	for (char **member = group->gr_mem; *member; member++)
		if (strcmp(*member, user) == 0)
			return true;
	return false;
}

/* Of the group named, or of all groups for NULL, until `look` is true. */
typedef bool look_at_group_fn(const struct group *group, void *user);

static bool walk_groups(const struct doctor *doctor, look_at_group_fn *look, void *user)
{
	FILE *file = tree_open(doctor, "/etc/group");
	struct group *group;
	bool done = false;

	while (file && !done && (group = fgetgrent(file)))
		done = look(group, user);
	if (file)
		fclose(file);
	return done;
}

struct group_search {
	const char *name, *member; /* member NULL: anybody */
	gid_t gid;
};

static bool matches(const struct group *group, void *user)
{
	struct group_search *search = user;

	if (strcmp(group->gr_name, search->name) != 0 ||
	    (search->member && !is_member(group, search->member)))
		return false;
	search->gid = group->gr_gid;
	return true;
}

bool group_find(const struct doctor *doctor, const char *name, gid_t *gid)
{
	struct group_search search = {.name = name};

	if (!walk_groups(doctor, matches, &search))
		return false;
	*gid = search.gid;
	return true;
}

bool group_lists(const struct doctor *doctor, const char *group, const char *user)
{
	struct group_search search = {.name = group, .member = user};

	return walk_groups(doctor, matches, &search);
}

void person_add_group(struct person *person, gid_t gid)
{
	if (person->gid_count < PERSON_GROUP_MAX)
		person->gids[person->gid_count++] = gid;
}

static bool add_if_member(const struct group *group, void *user)
{
	struct person *person = user;

	if (is_member(group, person->name))
		person_add_group(person, group->gr_gid);
	return false;
}

bool person_find(const struct doctor *doctor, const char *name, struct person *out)
{
	FILE *file = tree_open(doctor, "/etc/passwd");
	struct passwd *user = NULL;

	while (file && (user = fgetpwent(file)) && strcmp(user->pw_name, name) != 0)
		;
	if (user) {
		*out = (struct person){.uid = user->pw_uid};
		snprintf(out->name, sizeof(out->name), "%s", name);
		person_add_group(out, user->pw_gid);
		walk_groups(doctor, add_if_member, out);
	}
	if (file)
		fclose(file);
	return user != NULL;
}

bool person_in_group(const struct person *person, gid_t gid)
{
	for (uint32_t g = 0; g < person->gid_count; g++)
		if (person->gids[g] == gid)
			return true;
	return false;
}

bool person_may_use(const struct person *person, const struct stat *st)
{
	mode_t wanted = S_IROTH | S_IWOTH;

	if (person->uid == 0)
		return true;
	if (person->uid == st->st_uid)
		wanted = S_IRUSR | S_IWUSR;
	else if (person_in_group(person, st->st_gid))
		wanted = S_IRGRP | S_IWGRP;
	return (st->st_mode & wanted) == wanted;
}
