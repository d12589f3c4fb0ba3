/*
 * The usb: trigger keeps the contract on an adapter that is a part of the program.
 */
#include <stdlib.h>
#include <unistd.h>

#include "drivers/usb/trigger_usb.h"
#include "tests/contract/trigger_contract.h"
#include "tests/usb/fake_ft232h.h"

int main(void)
{
	char levels[] = "/tmp/stage-usb-XXXXXX";
	const char *const dark[] = {levels, NULL};
	int fd = mkstemp(levels);

	if (fd < 0)
		return 1;
	close(fd);
	fake_ft232h->levels_path = levels;
	const struct trigger_contract contract = {
		.driver = &usb_trigger_driver,
		.rest = "FAKE,ir=D5,strobe=D6,hd=D7",
		.bad_rest = "OTHER",
		.dark = dark,
		.plan = &trigger_contract_fast_plan,
	};
	int failed = trigger_contract_run(&contract);

	unlink(levels);
	return failed;
}
