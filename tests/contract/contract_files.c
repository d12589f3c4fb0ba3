/*
 * The files: driver keeps the contract: contract_files paced|unpaced
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "drivers/files/files.h"
#include "tests/contract/camera_contract.h"

#define FRAMES 8

static void make_recording(const char *dir)
{
	char path[64];

	snprintf(path, sizeof(path), "%s/frames.csv", dir);
	FILE *table = fopen(path, "w");
	fprintf(table, "shot,mid_exposure_ns,uncertainty_ns,file\n");
	for (int i = 0; i < FRAMES; i++) {
		snprintf(path, sizeof(path), "%s/%d.pgm", dir, i);
		FILE *image = fopen(path, "w");
		fprintf(image, "P5 64 48 255\n");
		for (int p = 0; p < 64 * 48; p++)
			fputc((p + i) & 255, image);
		fclose(image);
		fprintf(table, "%d,%d,1000,%d.pgm\n", i, 1000000000 + i * 8333333, i);
	}
	fclose(table);
}

static void remove_recording(const char *dir)
{
	char path[64];

	for (int i = 0; i < FRAMES; i++) {
		snprintf(path, sizeof(path), "%s/%d.pgm", dir, i);
		unlink(path);
	}
	snprintf(path, sizeof(path), "%s/frames.csv", dir);
	unlink(path);
	rmdir(dir);
}

int main(int argc, char **argv)
{
	char dir[] = "/tmp/contract_filesXXXXXX";
	bool paced = argc > 1 && strcmp(argv[1], "paced") == 0;
	struct camera_contract contract = {
		.driver = paced ? &files_camera_driver : &files_camera_driver_unpaced,
		.bad_rest = "no-such-recording",
		.base_dir = "/tmp",
		.live = paced,
		.frame_count = FRAMES,
	};

	if (!mkdtemp(dir))
		return 1;
	make_recording(dir);
	contract.rest = dir + strlen("/tmp/"); /* relative to base_dir */
	int failed = camera_contract_run(&contract);
	remove_recording(dir);
	return failed;
}
