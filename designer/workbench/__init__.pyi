from .record import (
    Record as Record,
    RecordedMotion as RecordedMotion,
)
from .record_formats import (
    read_record as read_record,
)
