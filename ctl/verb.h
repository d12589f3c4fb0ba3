/*
 * What a verb of stagectl is: a row of the table in main.c, and a file of its own.
 */
#pragma once

struct verb {
	const char *name;      /* one or two words: "status", "camera list" */
	const char *arguments; /* behind the name, for the usage line; "" for none */
	const char *summary;   /* one line */

	/* argv[0] is the last word of the name. Returns an exit code (base/exit_codes.h). */
	int (*run)(const struct verb *verb, int argc, char **argv);
};

int verb_start(const struct verb *verb, int argc, char **argv);
int verb_stop(const struct verb *verb, int argc, char **argv);
int verb_rig_reload(const struct verb *verb, int argc, char **argv);
int verb_status(const struct verb *verb, int argc, char **argv);
int verb_camera_list(const struct verb *verb, int argc, char **argv);
int verb_camera_show(const struct verb *verb, int argc, char **argv);
int verb_camera_preview(const struct verb *verb, int argc, char **argv);
int verb_camera_mask(const struct verb *verb, int argc, char **argv);
int verb_camera_noise(const struct verb *verb, int argc, char **argv);
int verb_calibrate_actor(const struct verb *verb, int argc, char **argv);
int verb_trigger_list(const struct verb *verb, int argc, char **argv);
int verb_stream_tap(const struct verb *verb, int argc, char **argv);
int verb_config_check(const struct verb *verb, int argc, char **argv);
int verb_doctor(const struct verb *verb, int argc, char **argv);
int verb_process(const struct verb *verb, int argc, char **argv);
int verb_sim_list(const struct verb *verb, int argc, char **argv);
int verb_sim_play(const struct verb *verb, int argc, char **argv);
int verb_sim_preview(const struct verb *verb, int argc, char **argv);
int verb_sim_record(const struct verb *verb, int argc, char **argv);
int verb_calibrate_board(const struct verb *verb, int argc, char **argv);
int verb_calibrate_cameras(const struct verb *verb, int argc, char **argv);
int verb_calibrate_origin(const struct verb *verb, int argc, char **argv);
int verb_calibrate_refine(const struct verb *verb, int argc, char **argv);
int verb_calibrate_list(const struct verb *verb, int argc, char **argv);
int verb_calibrate_show(const struct verb *verb, int argc, char **argv);
int verb_calibrate_rollback(const struct verb *verb, int argc, char **argv);
