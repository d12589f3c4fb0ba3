/*
 * GenICam XML over the registers of Aravis' fake camera. The trigger source Line0 is register value
 * 1, which the fake camera fires by its software-trigger register: the simulator's pulse line.
 */
#include "sim/gige/gige_genicam.h"

#include <stdio.h>
#include <stdlib.h>

#define CATEGORY(name, features) "<Category Name=\"" name "\">" features "</Category>\n"
#define FEATURE(name) "<pFeature>" name "</pFeature>"
#define STRING_REGISTER(name, address, length)                                       \
	"<StringReg Name=\"" name "\"><Address>" address "</Address><Length>" length \
	"</Length><AccessMode>RO</AccessMode><pPort>Device</pPort></StringReg>\n"
#define REGISTER(name, address, access)                                                 \
	"<IntReg Name=\"" name "\"><Address>" address "</Address><Length>4</Length>"    \
	"<AccessMode>" access "</AccessMode><pPort>Device</pPort><Sign>Unsigned</Sign>" \
	"<Endianess>BigEndian</Endianess></IntReg>\n"
#define INTEGER(name) "<Integer Name=\"" name "\"><pValue>" name "Register</pValue></Integer>\n"
#define ENTRY(name, value) "<EnumEntry Name=\"" name "\"><Value>" value "</Value></EnumEntry>"
#define ENUMERATION(name, entries)                                \
	"<Enumeration Name=\"" name "\">" entries "<pValue>" name \
	"Register</pValue></Enumeration>\n"
#define COMMAND(name, value)                                              \
	"<Command Name=\"" name "\"><pValue>AcquisitionRegister</pValue>" \
	"<CommandValue>" value "</CommandValue></Command>\n"
#define CONSTANT_FLOAT(name, unit)                                           \
	"<Float Name=\"" name "\"><ImposedAccessMode>RO</ImposedAccessMode>" \
	"<Value>%.6f</Value><Unit>" unit "</Unit></Float>\n"

static const char XML_FORMAT[] =
	"<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
	"<RegisterDescription ModelName=\"sim-gige\" VendorName=\"stage\""
	" StandardNameSpace=\"GEV\" SchemaMajorVersion=\"1\" SchemaMinorVersion=\"0\""
	" SchemaSubMinorVersion=\"1\" MajorVersion=\"1\" MinorVersion=\"0\" SubMinorVersion=\"0\""
	" ToolTip=\"Simulated camera\" ProductGuid=\"0\" VersionGuid=\"0\""
	" xmlns=\"http://www.genicam.org/GenApi/Version_1_0\">\n"
	/* clang-format off */
	CATEGORY("Root", FEATURE("DeviceControl") FEATURE("ImageFormatControl")
		 FEATURE("AcquisitionControl") FEATURE("TransportLayerControl"))
	CATEGORY("DeviceControl", FEATURE("DeviceVendorName") FEATURE("DeviceModelName")
		 FEATURE("DeviceVersion") FEATURE("DeviceSerialNumber") FEATURE("DeviceUserID"))
	STRING_REGISTER("DeviceVendorName", "0x48", "32")
	STRING_REGISTER("DeviceModelName", "0x68", "32")
	STRING_REGISTER("DeviceVersion", "0x88", "32")
	STRING_REGISTER("DeviceSerialNumber", "0xd8", "16")
	STRING_REGISTER("DeviceUserID", "0xe8", "16")

	CATEGORY("ImageFormatControl", FEATURE("SensorWidth") FEATURE("SensorHeight")
		 FEATURE("Width") FEATURE("Height") FEATURE("PixelFormat"))
	INTEGER("SensorWidth") REGISTER("SensorWidthRegister", "0x11c", "RO")
	INTEGER("SensorHeight") REGISTER("SensorHeightRegister", "0x118", "RO")
	INTEGER("Width") REGISTER("WidthRegister", "0x100", "RO")
	INTEGER("Height") REGISTER("HeightRegister", "0x104", "RO")
	ENUMERATION("PixelFormat", ENTRY("Mono8", "17301505"))
	REGISTER("PixelFormatRegister", "0x128", "RO")

	CATEGORY("AcquisitionControl", FEATURE("AcquisitionMode") FEATURE("AcquisitionStart")
		 FEATURE("AcquisitionStop") FEATURE("AcquisitionFrameRate")
		 FEATURE("ExposureTime") FEATURE("Gain") FEATURE("TriggerSelector")
		 FEATURE("TriggerMode") FEATURE("TriggerSource") FEATURE("TriggerActivation"))
	ENUMERATION("AcquisitionMode", ENTRY("Continuous", "1"))
	REGISTER("AcquisitionModeRegister", "0x12c", "RW")
	COMMAND("AcquisitionStart", "1")
	COMMAND("AcquisitionStop", "0")
	REGISTER("AcquisitionRegister", "0x124", "RW")
	CONSTANT_FLOAT("AcquisitionFrameRate", "Hz")
	CONSTANT_FLOAT("ExposureTime", "us")
	CONSTANT_FLOAT("Gain", "dB")
	"<Enumeration Name=\"TriggerSelector\">" ENTRY("FrameStart", "0")
	"<Value>0</Value></Enumeration>\n"
	ENUMERATION("TriggerMode", ENTRY("Off", "0") ENTRY("On", "1"))
	REGISTER("TriggerModeRegister", "0x300", "RW")
	ENUMERATION("TriggerSource", ENTRY("Line0", "1"))
	REGISTER("TriggerSourceRegister", "0x304", "RW")
	ENUMERATION("TriggerActivation", ENTRY("RisingEdge", "0"))
	REGISTER("TriggerActivationRegister", "0x308", "RW")

	CATEGORY("TransportLayerControl", FEATURE("PayloadSize"))
	"<IntSwissKnife Name=\"PayloadSize\"><pVariable Name=\"W\">Width</pVariable>"
	"<pVariable Name=\"H\">Height</pVariable><Formula>W * H</Formula></IntSwissKnife>\n"
	"<Port Name=\"Device\"/>\n";
/* clang-format on */

/* A camera with PTP is its master's slave as soon as it is told to follow. */
static const char XML_PTP[] =
	"<Boolean Name=\"PtpEnable\"><pValue>PtpEnableRegister</pValue></Boolean>\n" REGISTER(
		"PtpEnableRegister", "0x3f0",
		"RW") "<Enumeration Name=\"PtpStatus\">" ENTRY("Listening", "4")
		ENTRY("Slave", "9") "<pValue>PtpState</pValue></Enumeration>\n"
				    "<IntSwissKnife Name=\"PtpState\"><pVariable "
				    "Name=\"E\">PtpEnableRegister</pVariable>"
				    "<Formula>4 + 5 * E</Formula></IntSwissKnife>\n";
static const char XML_END[] = "</RegisterDescription>\n";

char *gige_genicam_xml(double rate_hz, double exposure_us, bool ptp)
{
	char *xml, *head;

	if (asprintf(&head, XML_FORMAT, rate_hz, exposure_us, 0.0) < 0)
		return NULL;
	if (asprintf(&xml, "%s%s%s", head, ptp ? XML_PTP : "", XML_END) < 0)
		xml = NULL;
	free(head);
	return xml;
}
