/*
 * The revisions of a rig. RIG is a link to RIG.d/NNNN, one directory per calibration, counted on;
 * a rig that was there as a plain directory becomes a revision with the first change. What is in
 * force changes in one step, so that a station that loads sees one rig or the other.
 */
#pragma once

#include <limits.h>
#include <stdbool.h>
#include <stdint.h>

#include "base/diag.h"

#define RIG_REVISION_MAX 9999
#define RIG_STORE_PATH (PATH_MAX - 64)

/* "RIG.d", and "RIG.d/NAME" with a name. Makes RIG.d when `make`. Returns 0 or a negative errno
 * with a message. */
int rig_store_path(char path[PATH_MAX], const char *rig_dir, const char *name, bool make,
		   struct diag *diag);

/* Whether a calibration may take the place RIG: nothing is there, a directory, or its own link.
 * Returns 0 or a negative errno with a message; -EEXIST: something of the user's. */
int rig_store_check(const char *rig_dir, struct diag *diag);

/* RIG.d, made if need be, for this program alone until it is unlocked, or the program ends. Returns
 * 0 or a negative errno with a message, as rig_store_check(); -EBUSY: another one has it. */
int rig_store_lock(int *fd, const char *rig_dir, struct diag *diag);

/* Leaves no RIG.d behind when nothing was put there. A no-op with `fd` < 0. */
void rig_store_unlock(int fd, const char *rig_dir);

/* "RIG.d/NNNN". Returns 0 or -ENAMETOOLONG. */
int rig_store_revision_path(char path[PATH_MAX], const char *rig_dir, uint32_t number,
			    struct diag *diag);

/* The numbers in order; `numbers` has RIG_REVISION_MAX places. Returns their count or a negative
 * errno with a message; no store: 0. */
int rig_store_list(const char *rig_dir, uint32_t *numbers, struct diag *diag);

/* The number in force; 0: none, or a plain directory. */
uint32_t rig_store_in_force(const char *rig_dir);

/* The number for a new revision; where RIG is a plain directory, the one before stays free for it.
 */
int rig_store_next(const char *rig_dir, uint32_t *number, struct diag *diag);

/* Brings RIG.d/NNNN into force. A plain directory RIG becomes the revision before, `*kept` (0:
 * there was none). Returns 0 or a negative errno with a message; then nothing has changed. */
int rig_store_put_in_force(const char *rig_dir, uint32_t number, uint32_t *kept, struct diag *diag);
