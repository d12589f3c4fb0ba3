/*
 * The usb: trigger keeps the contract:
 *
 *     contract_usb SERIAL,strobe=LINE,... [FILE...]
 *
 * on an adapter of this machine; each FILE reads 0 while one of its lines is dark. Without an
 * address it says that it skips.
 */
#include "drivers/usb/trigger_usb.h"
#include "tests/contract/trigger_contract.h"

int main(int argc, char **argv)
{
	return trigger_contract_main(argc, argv, &usb_trigger_driver, "no-such-adapter", "adapter");
}
