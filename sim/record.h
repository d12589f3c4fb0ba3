/*
 * Recordings of a scene: directories for files: cameras, with the truth beside them.
 */
#pragma once

#include <stdint.h>

#include "base/diag.h"
#include "sim/world/scene.h"

typedef void sim_progress_fn(uint64_t shots_done, uint64_t shot_count, void *user);

/*
 * Writes DIR/NAME/NNNNNN.pgm and DIR/NAME/frames.csv per camera, DIR/rig, DIR/layout.yaml (of
 * several actors: DIR/layout-ACTOR.yaml), DIR/stage.yaml, DIR/live.yaml (the same
 * cameras live; not of a board) and DIR/truth.jsonl, one object a shot:
 *   {"shot", "mid_exposure_ns", "heads": [{"actor", "q": [w,x,y,z], "t_m": [x,y,z]}],
 *    "head": the first of them,
 *    "markers": [{"name", "actor", "p_m": [x,y,z], "worn", "cameras": k, "visible": ["ir0", ...]}],
 *    "ghosts": [{"p_m", "visible"}]}
 * HD cameras have images in the shots that they expose in alone: their Bayer mosaics (RGGB) as grey
 * PGM, which a files: camera of role hd takes for what they are.
 * The scene's faults are in it as far as a recording can hold them: frames that never came are not
 * there, pictures and times are as the camera would have given them.
 * The same options and seconds give the same bytes. An older simulated recording in DIR is
 * replaced; any other non-empty directory is refused (-EEXIST). frames.csv and truth.jsonl appear
 * under their names only when they are whole. `progress` may be NULL. Returns 0 or a negative errno
 * with a message that names the path.
 */
int sim_record(const struct sim_options *options, const char *dir, double seconds,
	       sim_progress_fn *progress, void *user, struct diag *diag);
