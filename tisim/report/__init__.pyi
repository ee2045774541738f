from .run_report import ReportOptions as ReportOptions
from .run_report import read_checks as read_checks
from .run_report import run_report as run_report
