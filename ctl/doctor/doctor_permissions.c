/*
 * Whether the one who asks and the service's user are in the groups that it takes, and may open
 * the devices that are there.
 */
#include <string.h>
#include <unistd.h>

#include "ctl/doctor/doctor.h"
#include "ctl/doctor/doctor_person.h"
#include "ctl/doctor/doctor_tree.h"
#include "ctl/doctor/doctor_unit.h"

#define SERVICE_USER "staged"
#define OPERATORS "stage-operator"
#define RULES "rules.d/70-stage.rules"

static void find_missing_groups(struct doctor *doctor)
{
	bool serious = unit_installed(doctor);
	struct finding *finding = doctor_find(doctor, serious ? FINDING_PROBLEM : FINDING_NOTE,
					      "groups stage and " OPERATORS);

	doctor_say(finding->measured, "there are no such groups");
	doctor_say(finding->remedy,
		   "install stage, then systemd-sysusers; until then only root and group video may "
		   "open devices");
}

static void check_asker_in(struct doctor *doctor, const char *name, gid_t gid)
{
	const struct person *asker = &doctor->facts.asker;
	bool in = asker->uid == 0 || person_in_group(asker, gid);
	bool later = !in && group_lists(doctor, name, asker->name);
	struct finding *finding = doctor_find(doctor, in ? FINDING_OK : FINDING_PROBLEM,
					      "%s in group %s", asker->name, name);

	doctor_say(finding->measured, "%s",
		   asker->uid == 0 ? "root may all"
		   : in            ? "member"
		   : later         ? "member, but not since this login"
				   : "not a member");
	if (in)
		return;
	doctor_say(finding->limit, "%s",
		   strcmp(name, OPERATORS) == 0 ? "to command and to open devices" : "to look");
	if (later)
		doctor_say(finding->remedy, "log in again");
	else
		doctor_say(finding->remedy, "sudo usermod -aG %s %s, then log in again", name,
			   asker->name);
}

static void check_asker_groups(struct doctor *doctor)
{
	gid_t stage, operators;

	if (!group_find(doctor, "stage", &stage) || !group_find(doctor, OPERATORS, &operators)) {
		find_missing_groups(doctor);
		return;
	}
	check_asker_in(doctor, "stage", stage);
	check_asker_in(doctor, OPERATORS, operators);
}

/* The unit adds groups to those of its user. */
static void add_unit_groups(const struct doctor *doctor, struct person *service)
{
	char names[256], *rest;
	gid_t gid;

	if (!unit_read(doctor, "SupplementaryGroups", names, sizeof(names)))
		return;
	for (char *name = strtok_r(names, " ", &rest); name; name = strtok_r(NULL, " ", &rest))
		if (group_find(doctor, name, &gid))
			person_add_group(service, gid);
}

static bool find_service(struct doctor *doctor, struct person *service)
{
	struct finding *finding;
	bool has_user = person_find(doctor, SERVICE_USER, service);
	gid_t operators;

	if (!unit_installed(doctor)) {
		finding = doctor_find(doctor, FINDING_NOTE, "service staged");
		doctor_say(finding->measured, "not installed");
		doctor_say(finding->remedy, "as a service it has real-time rights and is started "
					    "again: sudo meson install -C build");
		return false;
	}
	if (has_user)
		add_unit_groups(doctor, service);
	bool good = has_user && group_find(doctor, OPERATORS, &operators) &&
		    person_in_group(service, operators);
	finding = doctor_find(doctor, good ? FINDING_OK : FINDING_PROBLEM,
			      "user " SERVICE_USER " in group " OPERATORS);
	doctor_say(finding->measured, "%s",
		   good       ? "member"
		   : has_user ? "not a member"
			      : "there is no such user");
	if (!good)
		doctor_say(finding->remedy, "%s",
			   has_user ? "SupplementaryGroups=" OPERATORS
				      " video belongs in the unit: systemctl edit staged"
				    : "sudo systemd-sysusers");
	return has_user;
}

static void check_rules(struct doctor *doctor)
{
	static const char *const places[] = {"/etc/udev/" RULES, "/usr/lib/udev/" RULES,
					     "/lib/udev/" RULES, "/usr/local/lib/udev/" RULES};
	bool needed = unit_installed(doctor) || doctor_uses(doctor, "v4l2") ||
		      doctor_uses(doctor, "libcamera") || doctor_uses(doctor, "gpio") ||
		      doctor_uses(doctor, "usb");
	const char *place = NULL;

	for (size_t p = 0; p < sizeof(places) / sizeof(places[0]) && !place; p++)
		if (tree_exists(doctor, places[p]))
			place = places[p];
	struct finding *finding = doctor_find(doctor,
					      place    ? FINDING_OK
					      : needed ? FINDING_PROBLEM
						       : FINDING_NOTE,
					      "udev rule 70-stage.rules");

	doctor_say(finding->measured, "%s", place ? place : "not installed");
	if (!place)
		doctor_say(
			finding->remedy,
			"cameras, GPIO chips and USB triggers stay root's: sudo meson install -C "
			"build && sudo udevadm control --reload && sudo udevadm trigger");
}

/* A kind of device nodes. */
struct kind {
	const char *what, *pattern;
	const char *driver; /* whose address in the config needs one */
};

static const struct kind kinds[] = {
	{"cameras /dev/video*", "/dev/video[0-9]*", "v4l2"},
	{"media devices /dev/media*", "/dev/media[0-9]*", "libcamera"},
	{"GPIO chips /dev/gpiochip*", "/dev/gpiochip[0-9]*", "gpio"},
};

/* Access control lists of a desktop's seat count for who sits there: the kernel is asked. */
static bool may_open(const struct doctor *doctor, const struct person *person, const char *path)
{
	struct stat st;

	if (person == &doctor->facts.asker && !*doctor->root)
		return access(path, R_OK | W_OK) == 0;
	return stat(path, &st) == 0 && person_may_use(person, &st);
}

/* One finding for all nodes of a kind; the first that is closed is named. */
static void check_nodes(struct doctor *doctor, const char *what, char **paths, size_t count,
			const struct person *person)
{
	const char *closed = NULL;
	uint32_t closed_count = 0;

	for (size_t i = 0; i < count; i++)
		if (!may_open(doctor, person, paths[i])) {
			closed = closed ? closed : tree_name(doctor, paths[i]);
			closed_count++;
		}
	struct finding *finding = doctor_find(doctor, closed ? FINDING_PROBLEM : FINDING_OK,
					      "%s for %s", what, person->name);
	if (closed) {
		doctor_say(finding->measured, "%u of %zu closed: %s", closed_count, count, closed);
		doctor_say(finding->remedy,
			   "group %s by udev rule 70-stage.rules: sudo udevadm trigger, or sudo "
			   "usermod -aG %s %s",
			   OPERATORS, OPERATORS, person->name);
	} else {
		doctor_say(finding->measured, "%zu, may be opened", count);
	}
}

static void check_kind(struct doctor *doctor, const struct kind *kind, const struct person *service)
{
	glob_t found;

	tree_glob(doctor, kind->pattern, &found);
	if (found.gl_pathc) {
		check_nodes(doctor, kind->what, found.gl_pathv, found.gl_pathc,
			    &doctor->facts.asker);
		if (service)
			check_nodes(doctor, kind->what, found.gl_pathv, found.gl_pathc, service);
	} else if (doctor_uses(doctor, kind->driver)) {
		struct finding *finding = doctor_find(doctor, FINDING_PROBLEM, "%s", kind->what);

		doctor_say(finding->measured, "there are none");
		doctor_say(finding->limit, "the config names one");
		doctor_say(finding->remedy,
			   "plug it in, and look whether the kernel has a driver: dmesg, lsmod");
	}
	globfree(&found);
}

#define USB_NODE_MAX 64

/* A USB3 Vision camera, or an FT232H: they are opened by their USB nodes. */
static bool is_ours(const struct doctor *doctor, const char *device)
{
	char vendor[16], product[16], class[16], pattern[TREE_PATH_BYTES];
	bool is_camera = false;
	glob_t interfaces;

	tree_line(doctor, vendor, sizeof(vendor), "%s/idVendor", device);
	tree_line(doctor, product, sizeof(product), "%s/idProduct", device);
	if (strcmp(vendor, "0403") == 0 && strcmp(product, "6014") == 0)
		return true;
	snprintf(pattern, sizeof(pattern), "%s/*:*/bInterfaceClass", device);
	tree_glob(doctor, pattern, &interfaces);
	for (size_t i = 0; i < interfaces.gl_pathc && !is_camera; i++) {
		char *path = interfaces.gl_pathv[i];

		tree_line(doctor, class, sizeof(class), "%s", tree_name(doctor, path));
		is_camera = strcmp(class, "ef") == 0;
		if (!is_camera)
			continue;
		tree_line(doctor, class, sizeof(class), "%.*s/bInterfaceSubClass",
			  (int)(strrchr(path, '/') - path - (long)strlen(doctor->root)),
			  tree_name(doctor, path));
		is_camera = strcmp(class, "05") == 0;
	}
	globfree(&interfaces);
	return is_camera;
}

static void check_usb_nodes(struct doctor *doctor, const struct person *service)
{
	char paths[USB_NODE_MAX][TREE_PATH_BYTES], *list[USB_NODE_MAX];
	size_t count = 0;
	glob_t devices;

	tree_glob(doctor, "/sys/bus/usb/devices/*", &devices);
	for (size_t i = 0; i < devices.gl_pathc && count < USB_NODE_MAX; i++) {
		const char *device = tree_name(doctor, devices.gl_pathv[i]);
		int64_t bus, number;

		if (!is_ours(doctor, device) || !tree_number(doctor, &bus, "%s/busnum", device) ||
		    !tree_number(doctor, &number, "%s/devnum", device))
			continue;
		tree_path(doctor, paths[count], "/dev/bus/usb/%03d/%03d", (int)bus, (int)number);
		list[count] = paths[count];
		count++;
	}
	globfree(&devices);
	if (count)
		check_nodes(doctor, "USB cameras and triggers", list, count, &doctor->facts.asker);
	if (count && service)
		check_nodes(doctor, "USB cameras and triggers", list, count, service);
}

void doctor_check_permissions(struct doctor *doctor)
{
	struct person service;
	bool has_service;

	check_asker_groups(doctor);
	has_service = find_service(doctor, &service);
	check_rules(doctor);
	for (size_t k = 0; k < sizeof(kinds) / sizeof(kinds[0]); k++)
		check_kind(doctor, &kinds[k], has_service ? &service : NULL);
	check_usb_nodes(doctor, has_service ? &service : NULL);
}
